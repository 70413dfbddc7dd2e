"""camcomp verify."""

import json
import sys

import click

from camcomp.config import load_config
from camcomp.diagnostics import CheckFailed
from camcomp.files import write_all


@click.command()
@click.argument("corrected")
@click.option("--against", "original", metavar="ORIGINAL", required=True, help="Program that was compensated.")
@click.option("--config", "configs", metavar="FILE", multiple=True, required=True, help="Machine; later files win.")
@click.option("--json", "json_file", metavar="OUT.json", help="Residuals, in all and per source line.")
@click.option("--tolerance-um", type=click.FloatRange(min=0, min_open=True), help="Largest residual that passes.")
def command(
    corrected: str, original: str, configs: tuple[str, ...], json_file: str | None, tolerance_um: float | None
) -> None:
    """Settle a compensated program on the model and measure what is left.

    Only the text of CORRECTED counts. Exit code 1 when the residual is over the tolerance.
    """
    config = load_config(configs)
    from camcomp.job import Job
    from camcomp.programs import open_program
    from camcomp.verify import verify

    tolerance = tolerance_um or config.compensation.tolerance_um
    done = verify(open_program(corrected, config), open_program(original, config), Job(config))
    figures = done.as_json(tolerance)
    if json_file:
        write_all({json_file: (json.dumps(figures, indent=2) + "\n").encode()}, inputs=(corrected, original, *configs))
    worst = figures["residual"]["max_um"]
    print(
        f"residual rms {figures['residual']['rms_um']:.3f} um, max {worst:.3f} um at {figures['points']} points; "
        f"{done.joining} joining lines not counted",
        file=sys.stderr,
    )
    for each in sorted(done.lines, key=lambda e: -e.residual_um)[:10]:
        print(
            f"  line {each.line}: {each.residual_um:.3f} um in {each.moves} moves (vertex {each.vertex_um:.3f}, "
            f"chord +{each.chord_um:.3f}, rounding <= {each.rounding_um:.3f}, solver {each.convergence_um:.1e})",
            file=sys.stderr,
        )
    if not worst <= tolerance * (1.0 + 1e-9):
        lines = ", ".join(str(e.line) for e in done.lines if e.residual_um > tolerance)
        raise CheckFailed("CC601", f"{worst:.3f} um are left, more than {tolerance:g} um, at source lines {lines}")
