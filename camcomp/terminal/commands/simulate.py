"""camcomp simulate."""

from typing import TYPE_CHECKING

import click

from camcomp.ground.files import display_name, read_bytes, write_all
from camcomp.ground.places import STANDARD
from camcomp.ground.progress import part
from camcomp.terminal.commands._options import OUTPUT, dialect_option, quiet_option, stock_option
from camcomp.terminal.progress import say, working

if TYPE_CHECKING:
    from camcomp.api.machine import StockChoice


@click.command()
@click.argument("program")
@dialect_option
@click.option("--config", "configs", metavar="FILE", multiple=True, required=True, help="Machine; later files win.")
@click.option("-o", "--output", metavar="LOG.csv", type=OUTPUT, help="The log; default and -: standard output.")
@click.option(
    "--surface",
    metavar="OUT.stl",
    type=OUTPUT,
    help="What is left of the stock: a body, or with the suffix .csv heights. Needs workpiece: stock.",
)
@click.option(
    "--report", metavar="OUT.html", type=OUTPUT, help="The walls that are left, as a page. Needs workpiece: stock."
)
@click.option("--step-s", type=click.FloatRange(min=1e-5), default=0.02, show_default=True, help="Time between rows.")
@stock_option
@click.option("--air", is_flag=True, help="The tool does not cut.")
@click.option("--started-s", type=float, default=0.0, help="Start on the common clock, for effects of warming up.")
@quiet_option
def command(
    *,
    program: str,
    configs: tuple[str, ...],
    output: str | None,
    surface: str | None,
    report: str | None,
    step_s: float,
    stock: "StockChoice | None",
    air: bool,
    started_s: float,
    quiet: bool,
) -> None:
    """Write the log that the modelled machine would produce.

    The model is the config with its `effects:`; there is no noise. Columns and frames are those that diagnose reads. With
    --surface or --report alone, what the loaded tool leaves of the stock is written and no log.
    """
    from camcomp.api.machine import load_machine, read_program
    from camcomp.api.simulation import simulate, simulate_cut, walls_report
    from camcomp.report.inputs import Input

    machine = load_machine(*configs)
    source, outputs = read_program(program, machine), dict[str, bytes]()
    if output or not (surface or report):
        with working(f"simulating {program}", quiet=quiet):
            with part(0.0, 0.5):
                log = simulate(source, machine, step_s, cutting=not air, started_s=started_s, stock=stock)
            with part(0.5, 1.0):
                outputs[output or STANDARD] = log.to_csv()
        say(*(f"warning: {each}" for each in log.warnings), quiet=quiet)
    if surface:
        with working(f"cutting {program}", quiet=quiet):
            left = simulate_cut(source, machine, stock=stock)
        outputs[surface] = left.to_csv() if surface.endswith(".csv") else left.to_stl()
    if report:
        with working(f"drawing the walls of {program}", quiet=quiet):
            inputs = [
                Input("configuration", display_name(each), read_bytes(each)) for each in configs if each != STANDARD
            ]
            outputs[report] = walls_report(source, machine, inputs, stock=stock)
    write_all(outputs, inputs=(program, *configs))
