"""New projects: a machine file, a program, a schema for the editor; and the tutorial with its samples."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path

from camcomp import __version__
from camcomp.ground.errors import ConfigError, FileError, Location
from camcomp.ground.files import display_name, read_bytes, shipped, write_all
from camcomp.model.config.load import load_config
from camcomp.model.config.yaml_text import read_tree
from camcomp.model.config.yaml_tree import Node, plain

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
#   - {effect}
"""
_DEFAULT = "orthoglide"


@dataclass(frozen=True)
class ShippedMachine:
    """A machine file shipped with camcomp. title: name of the robot; source: of its numbers."""

    name: str
    title: str
    source: str
    path: Path


def machines() -> list[ShippedMachine]:
    """All machine files shipped with camcomp."""
    out = []
    for path in sorted(shipped("config").glob("*.yaml")):
        tree, _ = read_tree(path.read_bytes(), path.name)
        robot = plain(tree).get("robot") if isinstance(tree, Node) else None
        if robot:
            out.append(ShippedMachine(path.stem, robot["name"], robot.get("source", ""), path))
    return out


def start_project(
    directory: Path, *, machine: str | None = None, urdf: str | None = None, tip: str | None = None,
    base: str | None = None,
) -> tuple[list[Path], list[str]]:  # fmt: skip
    """Write a project into a folder, and return its files and notes on values to be filled in.

    Args:
        directory: of the project.
        machine: name of a shipped machine.
        urdf: file of an arm, for geometry and masses of the machine file.
        tip: link of the URDF that carries the tool.
        base: fixed link of the URDF.

    Raises:
        FileError: CC501, a file exists already.
        ConfigError: CC219, unknown machine; CC240, the URDF is unreadable or no machine.
    """
    notes = list[str]()
    if urdf is not None:
        from camcomp.model.config.urdf import machine_yaml, read_urdf

        arm = read_urdf(read_bytes(urdf), display_name(urdf), tip, base)
        if len(arm.moving) not in (3, 6):
            raise ConfigError(
                "CC240", f"{len(arm.moving)} joints move; a machine needs three (place of the tip) or six (its pose)",
                at=Location(display_name(urdf), 1, 1), hint="--tip names the link that carries the tool, --base the one that stands still",
            )  # fmt: skip
        text, notes = machine_yaml(arm, Path(urdf).name).encode(), list(arm.notes)
    else:
        text = _machine_text(machine or _DEFAULT)
    outputs: dict[Path, bytes] = {
        directory / "machine.yaml": text,
        directory / "groove.nc": shipped("samples/groove-circle-50.nc").read_bytes(),
        directory / "camcomp.schema.json": shipped("config/camcomp.schema.json").read_bytes(),
        directory / "README.md": _README.encode(),
    }
    _write_new(directory, outputs)
    return list(outputs), notes


def write_tutorial(directory: Path) -> list[Path]:
    """Write samples, machine files and documentation into a folder, in which their commands run. Raises FileError CC501."""
    outputs: dict[Path, bytes] = {}
    for folder in ("config", "docs", "samples"):
        root = shipped(folder)
        for path in sorted(root.rglob("*")):
            inside = path.relative_to(root)
            if path.is_file() and not any(part.startswith((".", "__")) for part in inside.parts):
                outputs[directory / folder / inside] = path.read_bytes()
    _write_new(directory, outputs)
    return list(outputs)


def _machine_text(name: str) -> bytes:
    known = {each.name: each.path for each in machines()}
    if name not in known:
        close = get_close_matches(name, known, n=1)
        hint = f"did you mean {close[0]}?" if close else f"there are {', '.join(known)}"
        raise ConfigError("CC219", f"no machine called '{name}' is shipped", hint=hint)
    actuators = load_config([known[name]]).robot.actuators
    slide = next((each for each, joint in actuators.items() if not joint.rotary), None)
    effect = "{effect: servo_lag, time_constant_ms: 5}"
    if slide is not None:
        effect = f"{{effect: backlash, target: {slide}, width_mm: 0.010}}"
    return known[name].read_bytes() + _KEYS.replace("{effect}", effect).encode()


def _write_new(directory: Path, outputs: Mapping[Path, bytes]) -> None:
    """Write new files and their folders. Raises FileError CC501 for an existing file."""
    for path in outputs:
        if path.exists():
            raise FileError("CC501", f"{path} is there already", hint="choose another folder")
    for folder in {path.parent for path in outputs} | {directory}:
        folder.mkdir(parents=True, exist_ok=True)
    write_all(outputs)
