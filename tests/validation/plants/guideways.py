"""A machine of three slides in a row, x bearing y bearing z bearing the tool, whose guideways are neither straight nor square.

Every error is put where it arises, as a rigid displacement of its carriage, and the displacements are multiplied: nothing
here is of first order only.  Letters are those of ISO 230-1: E, the direction in which (X, Y, Z) or about which (A, B, C) a
carriage errs, and the axis that moves.  Squareness: the second axis of a pair leans towards the first.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from tests.validation.plants import rotations
from tests.validation.plants.motion import Timeline, read

ROOT = Path(__file__).resolve().parents[3]
Law = Callable[[np.ndarray, np.ndarray], np.ndarray]  # of positions (n,) mm and senses of travel (n,): mm, or rad

HEAD = "G21 G90 G17 G94\n"
PROGRAMS = {
    "left": f"{HEAD}G0 X40 Y0 Z0\nG3 X40 Y0 I-40 J0 F1500\nG0 Z20\nM30\n",
    "right": f"{HEAD}G0 X30 Y0 Z10\nG2 X30 Y0 I-30 J0 F900\nG0 Z20\nM30\n",
    "ramps": f"{HEAD}G0 X-45 Y-40 Z-20\nG1 X45 Y-15 Z25 F2400\nG1 Y35 Z-5\nG1 X-40 Y45 Z10\nG1 Y-40 Z-25\nG0 Z20\nM30\n",
    "steps": f"{HEAD}G0 X-50 Y30 Z20\nG1 X50 F2400\nG1 Y-30 Z-15\nG1 X-50\nG1 Y30 Z20\nG0 Z20\nM30\n",
}
ROWS = 150
TIP_MM = 0.003


@dataclass(frozen=True)
class Guideways:
    """tool: mm from the spindle's face down to the tip. squareness: rad by pair; errors: laws by letters."""

    squareness: Mapping[str, float] = field(default_factory=dict)
    errors: Mapping[str, Law] = field(default_factory=dict)
    tool: float = 0.0

    def tips(self, position: np.ndarray, way: np.ndarray | None = None) -> np.ndarray:
        """Tips (n, 3) mm, from where the tip stood when the workpiece was probed at the program's origin.

        position (n, 3) mm of the slides, reached in senses of travel `way` (n, 3).
        """
        origin = np.array([[0.0, 0.0, self.tool]])
        way = np.zeros_like(position) if way is None else way
        return self._reached(position, way) - self._reached(origin, np.zeros((1, 3)))

    def _reached(self, position: np.ndarray, way: np.ndarray) -> np.ndarray:
        lean = np.eye(3)  # rows: directions of the slides
        for (first, second), angle in self.squareness.items():
            lean["xyz".index(second), "xyz".index(first)] += angle
        tip = np.tile([0.0, 0.0, -self.tool], (len(position), 1))
        for k in (2, 1, 0):  # from the tool to the base
            error = {d: self._error(d, k, position, way) for d in "XYZABC"}
            turn = rotations.turn(np.stack([error[d] for d in "ABC"], 1))
            shift = np.stack([error[d] for d in "XYZ"], 1)
            tip = position[:, k, None] * lean[k] + shift + np.einsum("nij,nj->ni", turn, tip)
        return tip

    def _error(self, direction: str, k: int, position: np.ndarray, way: np.ndarray) -> np.ndarray:
        law = self.errors.get(f"E{direction}{'XYZ'[k]}")
        return np.zeros(len(position)) if law is None else law(position[:, k], way[:, k])

    def drive(self, program: str) -> np.ndarray:
        """Tips (n, 3) at places all along a program's feed moves."""
        return self.tips(*_turning(dense(program) + [0.0, 0.0, self.tool]))


def dense(program: str) -> np.ndarray:
    """Tips (n, 3) all along a program's feed moves."""
    line = Timeline(read(program), looks_ahead=True)
    return line.sample(np.linspace(0.0, line.log_end, 20_000))["tip"]


def misses(tips: np.ndarray, wanted: str) -> float:
    """How far (mm, largest) tips (n, 3) are from the path of a program."""
    path = dense(wanted)
    at = np.clip(cKDTree(path).query(tips)[1], 1, len(path) - 2)
    off, along = tips - path[at], path[at + 1] - path[at - 1]
    along /= np.maximum(np.linalg.norm(along, axis=1), 1e-12)[:, None]
    return float(np.linalg.norm(off - (off * along).sum(1)[:, None] * along, axis=1).max())


def _turning(position: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Positions (n, 3) and the senses in which they were reached, the last one kept at standstill."""
    step = np.sign(np.round(np.diff(position, axis=0, append=position[-1:]), 9))
    moved = np.maximum.accumulate(np.where(step != 0, np.arange(len(step))[:, None], 0), axis=0)
    return position, np.take_along_axis(step, moved, axis=0)


def experiment(
    folder: Path,
    machine: Guideways,
    seed: int = 1,
    *,
    programs: Mapping[str, str] = PROGRAMS,
    beside: Callable[[np.ndarray], np.ndarray] | None = None,
) -> Path:
    """Writes programs, logs with noise and experiment.yaml for the shipped Cartesian machine; the path of the latter.

    beside: what moves the tips (n, 3) mm at times (n,) s of the common clock, whatever the guideways do.
    """
    rng = np.random.default_rng(seed)
    (folder / "tool.yaml").write_text(f"tool: {{length_mm: {machine.tool}}}\nprocess: {{force: {{model: none}}}}\n")
    text = f"config: [{ROOT / 'config' / 'cartesian.yaml'}, tool.yaml]\nruns:\n"
    for k, (name, program) in enumerate(programs.items()):
        line = Timeline(read(program))
        t = (np.arange(ROWS) + 0.5) * line.log_end / ROWS
        seen = line.sample(t)
        slides, way = _turning(seen["tip"] + [0.0, 0.0, machine.tool])
        tip = machine.tips(slides, way) + rng.normal(0.0, TIP_MM, slides.shape)
        tip += 0.0 if beside is None else beside(100.0 * k + t)
        table = np.column_stack([t, seen["line"], tip, slides, slides])
        head = "t_s,line,x_mm,y_mm,z_mm,cmd_x_mm,cmd_y_mm,cmd_z_mm,act_x_mm,act_y_mm,act_z_mm"
        np.savetxt(folder / f"{name}.csv", table, fmt="%.5f", delimiter=",", header=head, comments="")
        (folder / f"{name}.nc").write_text(program)
        text += f"  - {{name: {name}, program: {name}.nc, log: {name}.csv, cutting: false, started_s: {100 * k}}}\n"
    path = folder / "experiment.yaml"
    path.write_text(text)
    return path
