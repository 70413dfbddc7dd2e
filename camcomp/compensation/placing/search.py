"""Places, turns and start postures of a program, each judged by compensating it there.

Judged by the band where the machine file has uncertain numbers: 95 % of the points of machines drawn from them stay
below it after compensation. Without uncertain numbers by the largest error before compensation, of which an unmodelled
share stays. A grid over the table comes first, then two rounds of half the step about the best place.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Literal

import numpy as np

from camcomp.compensation.program.compensate import compensate
from camcomp.gcode.program import Program
from camcomp.ground import path_geometry, progress
from camcomp.ground.datatypes import RAPID, Path
from camcomp.ground.errors import CamcompError
from camcomp.ground.result import Result, Size
from camcomp.model.config.load import overridden
from camcomp.model.config.robot import PrismaticActuator, RevoluteActuator
from camcomp.model.config.spec import Config
from camcomp.model.control import program_of
from camcomp.model.job import Job

Posture = Literal["stated", "wrist flipped"]
HALF_TABLE_MM = 500.0  # of the square that is searched by default, where no travel is shorter
MOST_MOTIONS = 400  # of a program that is judged whole
SAMPLED = 60  # motions of a longer one
ROUNDS = 2  # of refinement
WRIST = 3  # last joints of an arm
ALIKE_DECIMALS = 2  # of um: what differs by less is alike


class Placement(Result):
    """One place of the program's zero (G54, machine frame) and what is left there. why: why it cannot be cut there."""

    x_mm: float
    y_mm: float
    z_mm: float
    turn_deg: float
    posture: Posture
    judged_um: Size | None
    before_max_um: Size | None
    band_p95_um: Size | None
    why: str = ""


class PlacingResult(Result):
    """What `camcomp place` found. motions: how many of the program were judged, and how many it has."""

    judged_by: Literal["band", "before"]
    stated: Placement
    best: Placement | None
    motions: tuple[int, int]
    placements: tuple[Placement, ...]


@dataclass(frozen=True)
class MachineTable:
    """The places to look at: ends of X and Y (mm, machine frame; None: about the stated place), steps, turns (deg)."""

    x_mm: tuple[float, float] | None = None
    y_mm: tuple[float, float] | None = None
    steps: int = 5
    turns_deg: tuple[float, ...] = (0.0, 90.0)


def search_place(job: Job, program: Program, table: MachineTable) -> PlacingResult:
    """The best placement, with all that were judged."""
    data, judged = _short(program)
    about = _Judge(job, data, program.name)
    x0, y0, _ = job.config.workpiece.origin_mm
    stated = about.at((x0, y0, 0.0, "stated"))
    xs, ys = (_places(job, table, axis) for axis in (0, 1))
    turns = table.turns_deg if job.config.workpiece.rotation_vector_deg is None else (0.0,)
    grid = list(product(xs, ys, turns))
    with progress.part(0.0, 0.7):
        found = [stated, *about.all(((x, y, turn, "stated") for x, y, turn in grid), len(grid))]
    step = np.array([xs[1] - xs[0] if len(xs) > 1 else 0.0, ys[1] - ys[0] if len(ys) > 1 else 0.0])
    for k in range(ROUNDS):
        step, best = 0.5 * step, _best(found)
        if best is None:
            break
        near = [(best.x_mm + a * step[0], best.y_mm + b * step[1]) for a, b in product((-1, 0, 1), repeat=2) if a or b]
        inside = [(x, y) for x, y in near if xs[0] <= x <= xs[-1] and ys[0] <= y <= ys[-1]]
        others: list[Posture] = ["wrist flipped"] if _wrist(job.config) is not None else []
        tries = [(x, y, best.turn_deg, best.posture) for x, y in inside]
        tries += [(best.x_mm, best.y_mm, best.turn_deg, each) for each in others if k == 0]
        with progress.part(0.7 + 0.15 * k, 0.85 + 0.15 * k):
            found += about.all(tries, len(tries))
    by: Literal["band", "before"] = "band" if job.config.uncertain else "before"
    count = len(program.path)
    return PlacingResult(
        judged_by=by, stated=stated, best=_best(found), motions=(judged, count), placements=tuple(found)
    )


def _best(found: Sequence[Placement]) -> Placement | None:
    """The first of those with the least that is left."""
    usable = [each for each in found if each.judged_um is not None and np.isfinite(each.judged_um)]
    return min(usable, key=lambda each: round(each.judged_um or 0.0, ALIKE_DECIMALS), default=None)


def _places(job: Job, table: MachineTable, axis: int) -> list[float]:
    """Coordinates of one axis at which the program's zero is tried."""
    own = job.config.workpiece.origin_mm[axis]
    slides = [
        each.limits[1] - each.limits[0]
        for each in job.config.robot.actuators.values()
        if isinstance(each, PrismaticActuator) and each.limits is not None
    ]
    half = min([HALF_TABLE_MM, *(0.5 * each for each in slides)])
    low, high = (table.x_mm, table.y_mm)[axis] or (own - half, own + half)
    return np.linspace(low, high, table.steps).tolist() if high > low else [low]


Try = tuple[float, float, float, Posture]


@dataclass(frozen=True)
class _Judge:
    """Compensates one program at other places."""

    job: Job
    data: bytes
    name: str

    def all(self, tries: Iterable[Try], count: int) -> Iterator[Placement]:
        """Placements one after the other; each is a part of the work."""
        for each in progress.steps(tries, max(count, 1)):
            with progress.watched():
                yield self.at(each)

    def at(self, place: Try) -> Placement:
        """What is left at one place; errors say why it is none."""
        x, y, turn, posture = place
        config = self.job.taken.into(placed(self.job.config, place))
        job = replace(self.job, config=config)
        where = {"x_mm": x, "y_mm": y, "z_mm": config.workpiece.origin_mm[2], "turn_deg": turn, "posture": posture}
        settings, nothing = config.compensation, {"judged_um": None, "before_max_um": None, "band_p95_um": None}
        try:
            program = program_of(self.data, self.name, config)
            done = compensate(program, job, method=settings.method, tolerance_um=settings.tolerance_um, version="")
            failed = [text for rule, text in done.failed_checks(job, settings.tolerance_um) if rule == "CC602"]
            from camcomp.compensation.report.tables import summary

            figures = summary(done, job)
        except CamcompError as error:
            return Placement.model_validate({**where, **nothing, "why": error.message})
        if failed:
            return Placement.model_validate({**where, **nothing, "why": failed[0]})
        band = figures.expected.p95_um if figures.expected is not None else None
        before = figures.before.max_um
        sizes = {"judged_um": before if band is None else band, "before_max_um": before, "band_p95_um": band}
        return Placement.model_validate({**where, **sizes})


def placed(config: Config, place: Try) -> Config:
    """The configuration with the program's zero at a place, turned, and an arm that starts in a posture."""
    x, y, turn, posture = place
    over: dict[str, object] = {"origin_mm": [x, y, config.workpiece.origin_mm[2]]}
    if turn:
        over["rotation_deg"] = (config.workpiece.rotation_deg or 0.0) + turn
    starts = _wrist(config) if posture == "wrist flipped" else None
    return overridden(config, {"workpiece": over}, starts or {})


def _wrist(config: Config) -> dict[str, float] | None:
    """Start angles (deg) of the last three hinges of an arm with its wrist flipped; None for other machines."""
    actuators = config.robot.actuators
    if len(config.robot.chains) != 1 or len(actuators) != 2 * WRIST:
        return None
    last = list(actuators.items())[-WRIST:]
    angles = []
    for _, each in last:
        if not isinstance(each, RevoluteActuator):
            return None
        angles.append(each.home_deg if each.start_deg is None else each.start_deg)
    flipped = (_opposite(angles[0]), -angles[1], _opposite(angles[2]))
    return {name: angle for (name, _), angle in zip(last, flipped, strict=True)}


def _opposite(angle: float) -> float:
    """Half a turn on, at the smaller size of angle."""
    return angle - 180.0 if angle > 0.0 else angle + 180.0


def _short(program: Program) -> tuple[bytes, int]:
    """The program, or of a long one single motions spread over it and those at its outermost points; how many."""
    path = program.path
    count = len(path)
    if count <= MOST_MOTIONS:
        return program.data, count
    feeds = np.flatnonzero((path.kind != RAPID) & path.known & ~path.machine)
    ends = path.end[feeds]
    outermost = [f(ends[:, axis]) for axis in range(3) for f in (np.argmin, np.argmax)]
    spread = np.linspace(0, len(feeds) - 1, SAMPLED).astype(int)
    chosen = feeds[np.unique([*spread, *outermost])]
    lines = [line for k in chosen for line in _motion(path, int(k))]
    return "\n".join(["G21 G90 G17 G94", *lines, "M2", ""]).encode(), len(chosen)


def _motion(path: Path, k: int) -> Iterator[str]:
    """A rapid to the start of a motion, and a straight one along it."""
    turn = "M4" if path.turn[k] < 0.0 else "M3"
    start, end = path_geometry.points(path, np.array([k, k]), np.array([0.0, 1.0]))
    if path.speed[k] > 0.0:
        yield f"S{path.speed[k]:.0f} {turn}"
    for word, point in (("G0", start), ("G1", end)):
        feed = f" F{path.feed[k]:.3f}" if word == "G1" else ""
        yield f"{word} X{point[0]:.5f} Y{point[1]:.5f} Z{point[2]:.5f}{feed}"
