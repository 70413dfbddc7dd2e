"""The motion of LinuxCNC on a corrected program, measured and predicted by the model.

A file of data/ holds the corrected program, its end points with their targets and forces, and the tip that was commanded while it
ran, every millisecond in steps of 10 nm as second differences.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np

from camcomp.ground import path_geometry
from camcomp.ground.datatypes import ARC, RAPID
from camcomp.ground.files import shipped
from camcomp.model.config.load import load_config
from camcomp.model.control import limits_of, program_of
from camcomp.model.job import Job
from camcomp.model.statics.target import settle
from camcomp.model.trajectory.moves import moves_of
from camcomp.model.trajectory.plan import plan_of
from tests.control.measured import passes
from tests.control.programs import CONFIG, CONTROL
from tests.validation.plants import energy
from tests.validation.plants.legs import orthoglide

HERE = Path(__file__).parent
STEP_S, QUANTUM_MM = 1e-3, 1e-5
ON_ARC = 40  # places of an arc that the recorded motion is followed along


@dataclass(frozen=True)
class Driven:
    """A corrected program (bytes), its N end points, and the commanded tip (n, 3) mm, a row per millisecond."""

    program: np.ndarray
    cut: np.ndarray  # (N,) feed moves, no joining lines
    target: np.ndarray  # (N, 3) mm, program frame
    force: np.ndarray  # (N, 3) N, machine frame
    begin: np.ndarray  # (2, 3) first places
    bend: np.ndarray  # (n - 2, 3) second differences

    @property
    def tip(self) -> np.ndarray:
        step = np.cumsum(np.concatenate([self.begin[1:] - self.begin[:1], self.bend.astype(np.int64)]), 0)
        return np.concatenate([self.begin[:1], self.begin[:1] + np.cumsum(step, 0)]) * QUANTUM_MM

    def save(self, name: str, folder: Path = HERE / "data") -> None:
        folder.mkdir(exist_ok=True)
        np.savez_compressed(folder / f"{name}.npz", **{each.name: getattr(self, each.name) for each in fields(self)})


def load(name: str, folder: Path = HERE / "data") -> Driven:
    with np.load(folder / f"{name}.npz") as file:
        return Driven(**{each.name: file[each.name] for each in fields(Driven)})


def job() -> Job:
    """The machine of the programs, with the control that recorded them."""
    config = load_config([shipped(CONFIG)])
    return Job(config.model_copy(update={"control": config.control.model_copy(update=CONTROL["control"])}))


@dataclass(frozen=True)
class Account:
    """Seconds in motion, and largest and rms distance of the loaded tip from its targets in um: measured and modelled."""

    time: tuple[float, float]
    most: tuple[float, float]
    rms: tuple[float, float]

    def row(self) -> str:
        (t, s), (m, n), (r, q) = self.time, self.most, self.rms
        return f"{t:8.3f} {s:8.3f} {100 * (s / t - 1):+6.2f} %   {m:8.2f} {n:8.2f}   {r:8.2f} {q:8.2f}"


def account(driven: Driven, machine: Job) -> Account:
    """The truth plant on the recorded motion and the model on the program's text."""
    program = program_of(driven.program.tobytes(), "recorded.nc", machine.config)
    path, tip = program.path, driven.tip
    moving = np.flatnonzero(np.any(np.diff(tip, axis=0) != 0.0, axis=1))
    tip = tip[moving[0] : moving[-1] + 2]
    motion = np.repeat(np.arange(len(path)), np.where(path.kind == ARC, ON_ARC, 1))
    u = np.concatenate([np.arange(1, ON_ARC + 1) / ON_ARC if kind == ARC else [1.0] for kind in path.kind])
    places = passes(tip, path_geometry.points(path, motion, u))[u == 1.0]
    plan = plan_of(moves_of(path, program.modes, per_turn=program.per_turn), limits_of(machine.config))
    cut = np.flatnonzero(driven.cut & (path.kind != RAPID))
    modelled = path.end[cut] + plan.leaves_by(cut, path.end[cut])
    frame = machine.frame
    legs, target, force = orthoglide(roll_deg=1.0), frame.to_machine(driven.target[cut]), driven.force[cut]
    truth = energy.settle(legs, energy.inverse(legs, frame.to_machine(places[cut])), force).tip
    mine, _ = settle(machine.real_machine, frame.to_machine(modelled), force)
    off = [1e3 * np.linalg.norm(each - target, axis=1) for each in (truth, mine)]
    return Account(
        (len(tip) * STEP_S, plan.duration_s),
        (off[0].max(), off[1].max()),
        (float(np.sqrt(np.mean(off[0] ** 2))), float(np.sqrt(np.mean(off[1] ** 2)))),
    )
