"""LinuxCNC's stand-alone interpreter as an oracle: runs a program, gives its canonical motions.

Debian's package linuxcnc-uspace ships it as `rs274`. It is looked for in the environment variable CAMCOMP_RS274, then
on PATH; tests that need it are skipped where it is not there.
"""

import math
import os
import re
import shutil
import subprocess
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import pytest

_CALL = re.compile(r"^\s*\d+ N\S*\s+([A-Z0-9_]+)\((.*)\)\s*$")
_PLANE = {"CANON_PLANE_XY": 17, "CANON_PLANE_XZ": 18, "CANON_PLANE_YZ": 19}
_AXES = {17: (0, 1, 2), 18: (2, 0, 1), 19: (1, 2, 0)}


def binary() -> str | None:
    """Path of the interpreter, or None."""
    return os.environ.get("CAMCOMP_RS274") or shutil.which("rs274")


needs_rs274 = pytest.mark.skipif(binary() is None, reason="rs274 (Debian: linuxcnc-uspace) is not installed")


@dataclass
class Motion:
    """One canonical motion, in the units and coordinates in force; 4 decimals, as printed."""

    kind: str  # TRAVERSE, FEED or ARC
    end: tuple[float, float, float]
    unit: float
    offset: tuple[float, float, float]  # work offset + G92 + tool, in units
    feed: float  # mm/min (G95: mm/rev), by the unit in force when it was set
    feed_mode: str
    plane: int = 17
    centre: tuple[float, float] = (0.0, 0.0)  # in the order of the plane
    turns: int = 0  # signed
    call: str = ""
    machine: tuple[float, ...] = ()  # end in machine coordinates, mm, of lines


@dataclass
class Run:
    """Result of one program."""

    motions: list[Motion] = field(default_factory=list)
    error: str = ""
    speeds: list[float] = field(default_factory=list)


def run(
    program: str | bytes,
    *,
    offsets: Mapping[int, tuple[float, float, float]] | None = None,
    tools: Mapping[int, float] | None = None,
    homes: Mapping[int, tuple[float, float, float]] | None = None,
    table: str = "",
) -> Run:
    """Execute a program. `offsets` in mm by work offset number 1 to 9, `tools` lengths in mm, `homes` by G code.

    table: a tool table in inches, in place of `tools`.
    """
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder)
        data = program if isinstance(program, bytes) else program.encode()
        (root / "program.ngc").write_bytes(data)
        variables = {}
        for number, origin in (offsets or {}).items():
            for axis in range(3):
                variables[5201 + 20 * number + axis] = origin[axis] / 25.4
        for code, place in (homes or {}).items():
            for axis in range(3):
                variables[(5161 if code == 28 else 5181) + axis] = place[axis] / 25.4
        (root / "rs274.var").write_text("".join(f"{n}\t{v:.9f}\n" for n, v in sorted(variables.items())))
        # The stand-alone interpreter takes tool table and variables for inches.
        lengths = "".join(f"T{n} P{n} Z{z / 25.4:.9f} D0\n" for n, z in (tools or {}).items())
        (root / "tool.tbl").write_text(table or lengths or "T99 P99 Z0 D0\n")
        command = [str(binary()), "-g", "-v", "rs274.var", "-t", "tool.tbl", "program.ngc"]
        done = subprocess.run(
            command,
            cwd=folder,
            env={**os.environ, "HOME": folder},  # where its tools lie, which two at once would share
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            errors="replace",
            timeout=120,
            check=False,
        )
    result = _parse(done.stdout, done.stderr)
    result.error = result.error and f"{result.error} (exit {done.returncode})"
    return result


def _numbers(arguments: str) -> list[float]:
    return [float(each) for each in re.findall(r"[-+0-9.einf]+", arguments)]


def _parse(stdout: str, stderr: str) -> Run:
    result = Run()
    unit, plane, feed, feed_mode = 1.0, 17, 0.0, "0"
    work, shift, tool = [0.0] * 3, [0.0] * 3, [0.0] * 3  # mm
    turned = 0.0  # rad, of the program's axes about Z
    ended = False
    for line in stdout.splitlines():
        found = _CALL.match(line)
        if not found:
            continue
        name, arguments = found[1], found[2]
        offset = tuple((work[a] + shift[a] + tool[a]) / unit for a in range(3))
        if name == "USE_LENGTH_UNITS":
            unit = 25.4 if "INCH" in arguments else 1.0
        elif name == "SELECT_PLANE":
            plane = _PLANE[arguments]
        elif name == "SET_G5X_OFFSET":
            work = [each * unit for each in _numbers(arguments)[1:4]]
        elif name == "SET_G92_OFFSET":
            shift = [each * unit for each in _numbers(arguments)[:3]]
        elif name == "USE_TOOL_LENGTH_OFFSET":
            tool = [each * unit for each in _numbers(arguments)[:3]]
        elif name == "SET_XY_ROTATION":
            turned = math.radians(float(arguments))
        elif name == "SET_FEED_RATE":
            feed = float(arguments) * unit
        elif name == "SET_FEED_MODE":
            feed_mode = arguments
        elif name == "SET_SPINDLE_SPEED":
            result.speeds.append(_numbers(arguments)[-1])
        elif name in ("STRAIGHT_TRAVERSE", "STRAIGHT_FEED", "RIGID_TAP"):
            x, y, z = _numbers(arguments)[:3]
            u, v, w = (each * unit + shift[a] for a, each in enumerate((x, y, z)))
            c, s = math.cos(turned), math.sin(turned)
            machine = tuple(a + b + d for a, b, d in zip((c * u - s * v, s * u + c * v, w), work, tool, strict=True))
            motion = Motion(name.split("_")[-1], (x, y, z), unit, offset, feed, feed_mode, plane, call=line.strip())
            motion.machine = machine
            result.motions.append(motion)
        elif name == "ARC_FEED":
            a, b, ca, cb, turns, w = _numbers(arguments)[:6]
            end = [0.0, 0.0, 0.0]
            end[_AXES[plane][0]], end[_AXES[plane][1]], end[_AXES[plane][2]] = a, b, w
            result.motions.append(
                Motion("ARC", tuple(end), unit, offset, feed, feed_mode, plane, (ca, cb), int(turns), line.strip())
            )
        elif name in ("PROGRAM_END", "FINISH"):
            ended = True
    error = [each for each in stderr.splitlines() if each.strip() and each.strip() != "executing"]
    if not ended:
        result.error = error[0] if error else "stopped without a message"
    return result
