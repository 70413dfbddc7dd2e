"""camcomp init."""

from pathlib import Path

import click

from camcomp import __version__
from camcomp.ground.errors import FileError
from camcomp.ground.files import display_name, read_bytes, shipped, write_all

_README = f"""# A camcomp project

Written by camcomp {__version__}. `groove.nc` is a circular groove, `machine.yaml` the machine that is to mill it.

    camcomp compensate groove.nc --config machine.yaml -o groove-compensated.nc --summary summary.json

Put your own machine into `machine.yaml`; `camcomp validate machine.yaml` checks it, `camcomp explain` lists every rule.
"""

_KEYS = """
# --- further keys, with examples -------------------------------------------------------------------------------------
# workpiece:
#   rotation_deg: 0            # of the clamped part about the tool axis
#   stock_top_mm: 0            # feed moves at or above this height of the program frame cut air
# process:
#   spindle_rpm: 8000          # where the program has no S
# control:
#   start_mm: [0, 0, 50]       # tool tip before the first move, program frame
#   tool_lengths_mm: {1: 0}    # length offsets of G43 by tool number
#   input_increment_mm: 0.001  # worth of one unit in a number without a decimal point (older Fanuc)
# effects:                     # what the ideal model leaves out; `camcomp effects` lists them
#   - {effect: backlash, target: x, width_mm: 0.010}
"""


@click.command()
@click.argument("directory", metavar="DIR", type=click.Path(file_okay=False, path_type=Path))
@click.option("--from-urdf", "urdf", metavar="FILE", help="Arm whose geometry and masses the machine file takes.")
@click.option("--tip", metavar="LINK", help="Link of the URDF that carries the tool; default: the end of the chain.")
def command(directory: Path, urdf: str | None, tip: str | None) -> None:
    """Start a project: a machine file, a program, a README.

    DIR is made when it is not there. Nothing in it is overwritten.
    """
    machine = shipped("config/orthoglide.yaml").read_bytes() + _KEYS.encode()
    if urdf is not None:
        from camcomp.model.config.urdf import machine_yaml, read_urdf

        arm = read_urdf(read_bytes(urdf), display_name(urdf), tip)
        machine = machine_yaml(arm, Path(urdf).name).encode()
        for note in arm.notes:
            click.echo(note, err=True)
    outputs: dict[Path, bytes] = {
        directory / "machine.yaml": machine,
        directory / "groove.nc": shipped("samples/groove-circle-50.nc").read_bytes(),
        directory / "camcomp.schema.json": shipped("config/camcomp.schema.json").read_bytes(),
        directory / "README.md": _README.encode(),
    }
    for path in outputs:
        if path.exists():
            raise FileError("CC501", f"{path} is there already", hint="choose another folder")
    directory.mkdir(parents=True, exist_ok=True)
    write_all(outputs)
    for path in outputs:
        click.echo(f"wrote {path}", err=True)
    click.echo(f"next: camcomp compensate {directory / 'groove.nc'} --config {directory / 'machine.yaml'}", err=True)
