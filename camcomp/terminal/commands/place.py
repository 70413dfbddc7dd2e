"""camcomp place."""

from typing import TYPE_CHECKING

import click

from camcomp.ground.errors import CheckFailed
from camcomp.ground.files import display_name, read_bytes, write_all
from camcomp.ground.places import STANDARD
from camcomp.terminal.commands._options import OUTPUT, config_option, dialect_option, quiet_option, stock_option
from camcomp.terminal.progress import say, working

if TYPE_CHECKING:
    from camcomp.api.machine import StockChoice


@click.command()
@click.argument("program")
@dialect_option
@config_option
@click.option(
    "--x-mm", nargs=2, type=float, metavar="LOW HIGH", help="X of the table; default: about the stated place."
)
@click.option(
    "--y-mm", nargs=2, type=float, metavar="LOW HIGH", help="Y of the table; default: about the stated place."
)
@click.option("--steps", type=click.IntRange(1, 50), default=5, show_default=True, help="Places along each axis.")
@click.option(
    "--turn-deg",
    "turns",
    type=float,
    multiple=True,
    default=(0.0, 90.0),
    show_default=True,
    help="Turn to try; repeatable.",
)
@click.option("--json", "json_file", metavar="OUT.json", type=OUTPUT, help="All placements, as JSON.")
@click.option("--report", metavar="OUT.html", type=OUTPUT, help="The map, as a page.")
@stock_option
@quiet_option
def command(
    *, program: str, configs: tuple[str, ...], x_mm: tuple[float, float] | None, y_mm: tuple[float, float] | None, steps: int,
    turns: tuple[float, ...], json_file: str | None, report: str | None, stock: "StockChoice | None", quiet: bool,
) -> None:  # fmt: skip
    """Find where on the table a program is cut best: with the least error that compensation cannot be trusted to remove.

    The program is compensated at places of its zero (G54) over the table, turned about the tool axis, and at the
    best one with shoulder, elbow and wrist of an arm flipped; two rounds about the best place follow. Judged by the band where the machine file has uncertain numbers
    (sd), else by the largest error before compensation. Of programs beyond 400 motions single ones are judged. Exit code 1
    where the program can be cut at none of the places.
    """
    from camcomp.api.machine import load_machine
    from camcomp.api.placing import MachineTable, place, words
    from camcomp.report.inputs import Input

    machine = load_machine(*configs)
    with working(f"placing {display_name(program)}", quiet=quiet):
        done = place(program, machine, MachineTable(x_mm or None, y_mm or None, steps, turns), stock=stock)
    outputs = {json_file: done.result.to_json()} if json_file else {}
    if report:
        named = [(program, "program"), *((each, "configuration") for each in configs)]
        inputs = [Input(role, display_name(each), read_bytes(each)) for each, role in named if each != STANDARD]
        outputs[report] = done.report(inputs)
    write_all(outputs, inputs=(program, *configs))
    say(*(f"warning: {each}" for each in done.warnings), quiet=quiet)
    result = done.result
    if result.best is None:
        raise CheckFailed(
            "CC610", f"the program can be cut at none of {len(result.placements)} places: {result.stated.why}"
        )
    by = "band after compensation (95 %)" if result.judged_by == "band" else "largest error before compensation"
    stated = "not possible" if result.stated.judged_um is None else f"{result.stated.judged_um:.1f} um"
    say(f"{by}: {stated} where the machine file puts the program", quiet=quiet)
    say(f"at best {result.best.judged_um:.1f} um, with its origin at {words(result.best)}", quiet=quiet)
    at = f"[{result.best.x_mm:g}, {result.best.y_mm:g}, {result.best.z_mm:g}]"
    turn = (machine.config.workpiece.rotation_deg or 0.0) + result.best.turn_deg
    say(f"write: workpiece: {{origin_mm: {at}, rotation_deg: {turn:g}}}", quiet=quiet)
    if result.best.start_deg:
        joints = ", ".join(f"{name} {angle:g}" for name, angle in result.best.start_deg.items())
        say(f"and start_deg of the joints: {joints}", quiet=quiet)
