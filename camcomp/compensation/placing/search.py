"""Places, turns and start postures of a program, each judged by compensating it there.

Judged by the band where the machine file has uncertain numbers: 95 % of the points of machines drawn from them stay
below it after compensation. Without uncertain numbers by the largest error before compensation, of which an unmodelled
share stays. A grid over the table comes first, its corners included, then the other start postures of an arm at the best place,
then two rounds of half the step about the best one.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import partial
from itertools import product
from typing import Literal

import numpy as np
from pydantic import Field

from camcomp.compensation.program.compensate import compensate
from camcomp.gcode.program import Program
from camcomp.ground import path_geometry, progress
from camcomp.ground.datatypes import RAPID, Floats, Path
from camcomp.ground.errors import CamcompError
from camcomp.ground.records import dataclass, replace
from camcomp.ground.result import Result, Size
from camcomp.model.config.load import overridden
from camcomp.model.config.robot import PrismaticActuator
from camcomp.model.config.spec import Config
from camcomp.model.control import program_of
from camcomp.model.job import Job
from camcomp.model.statics.arm import arm_of, end_pose
from camcomp.model.statics.closedform import closed_form

HALF_TABLE_MM = 500.0  # of the square that is searched by default, where no travel is shorter
MOST_MOTIONS = 400  # of a program that is judged whole
SAMPLED = 60  # motions of a longer one
ROUNDS = 2  # of refinement
EQUAL_DECIMALS = 2  # of um: placements that differ by less are equal
STATED = "stated"
_PARTS = ("shoulder", "elbow", "wrist")  # the order of the branches of the closed form


class Placement(Result):
    """A position of the program's zero (G54, machine frame), its error, and the reason where it cannot be cut there."""

    x_mm: float
    y_mm: float
    z_mm: float
    turn_deg: float
    posture: str
    judged_um: Size | None = None
    before_max_um: Size | None = None
    band_p95_um: Size | None = None
    why: str = ""
    start_deg: dict[str, float] = Field(default_factory=dict)  # of the joints, in another posture than the stated one


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
    about = _Judge(job, data, program.name, start_postures(job))
    x0, y0, _ = job.config.workpiece.origin_mm
    stated = about.at((x0, y0, 0.0, STATED))
    xs, ys = (_places(job, table, axis) for axis in (0, 1))
    turns = table.turns_deg if job.config.workpiece.rotation_vector_deg is None else (0.0,)
    grid = list(product(xs, ys, turns))
    with progress.part(0.0, 0.6):
        found = [stated, *about.all(((x, y, turn, STATED) for x, y, turn in grid), len(grid))]
    start = _best(found) or stated
    others = [(start.x_mm, start.y_mm, start.turn_deg, each) for each in about.starts]
    with progress.part(0.6, 0.7):
        found += about.all(others, len(others))
    step = np.array([xs[1] - xs[0] if len(xs) > 1 else 0.0, ys[1] - ys[0] if len(ys) > 1 else 0.0])
    for k in range(ROUNDS):
        step, best = 0.5 * step, _best(found)
        if best is None:
            break
        near = [(best.x_mm + a * step[0], best.y_mm + b * step[1]) for a, b in product((-1, 0, 1), repeat=2) if a or b]
        inside = [(x, y) for x, y in near if xs[0] <= x <= xs[-1] and ys[0] <= y <= ys[-1]]
        tries = [(x, y, best.turn_deg, best.posture) for x, y in inside]
        with progress.part(0.7 + 0.15 * k, 0.85 + 0.15 * k):
            found += about.all(tries, len(tries))
    by: Literal["band", "before"] = "band" if job.config.uncertain else "before"
    count = len(program.path)
    return PlacingResult(
        judged_by=by, stated=stated, best=_best(found), motions=(judged, count), placements=tuple(found)
    )


def _best(found: Sequence[Placement]) -> Placement | None:
    """The placement with the smallest error, the first of equal ones."""
    usable = [each for each in found if each.judged_um is not None and np.isfinite(each.judged_um)]
    return min(usable, key=lambda each: round(each.judged_um or 0.0, EQUAL_DECIMALS), default=None)


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


Try = tuple[float, float, float, str]


@dataclass(frozen=True)
class _Judge:
    """Compensates one program at other places. starts: start angles (deg) by posture and joint."""

    job: Job
    data: bytes
    name: str
    starts: dict[str, dict[str, float]]

    def all(self, tries: Iterable[Try], count: int) -> Iterator[Placement]:
        """Placements one after the other; each is a part of the work."""
        for each in progress.steps(tries, max(count, 1)):
            with progress.watched():
                yield self.at(each)

    def at(self, place: Try) -> Placement:
        """Judge one placement; the message of an error is its reason."""
        x, y, turn, posture = place
        config = self.job.taken.into(placed(self.job.config, place, self.starts))
        job = replace(self.job, config=config)
        settings = config.compensation
        placement = partial(
            Placement, x_mm=x, y_mm=y, z_mm=config.workpiece.origin_mm[2], turn_deg=turn, posture=posture,
            start_deg=self.starts.get(posture, {}),
        )  # fmt: skip
        try:
            program = program_of(self.data, self.name, config)
            done = compensate(program, job, method=settings.method, tolerance_um=settings.tolerance_um, version="")
            from camcomp.compensation.program.totals import Totals

            totals = Totals.of(done, job)
            failed = [text for rule, text in totals.failed_checks(settings.tolerance_um) if rule == "CC602"]
            figures = totals.summary()
        except CamcompError as error:
            return placement(why=error.message)
        if failed:
            return placement(why=failed[0])
        band = figures.expected.p95_um if figures.expected is not None else None
        before = figures.before.max_um
        return placement(judged_um=before if band is None else band, before_max_um=before, band_p95_um=band)


def placed(config: Config, place: Try, starts: Mapping[str, dict[str, float]]) -> Config:
    """The configuration with the program's zero at a place, turned, and an arm that starts in a posture."""
    x, y, turn, posture = place
    over: dict[str, object] = {"origin_mm": [x, y, config.workpiece.origin_mm[2]]}
    if turn:
        over["rotation_deg"] = (config.workpiece.rotation_deg or 0.0) + turn
    return overridden(config, {"workpiece": over}, {} if posture == STATED else starts[posture])


def _short(program: Program) -> tuple[bytes, int]:
    """The program, or of a long one single motions spread over it and those at its outermost points; how many."""
    path = program.path
    count = len(path)
    feeds = np.flatnonzero((path.kind != RAPID) & path.known & ~path.machine)
    if count <= MOST_MOTIONS or not len(feeds):
        return program.data, count
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


def start_postures(job: Job) -> dict[str, dict[str, float]]:
    """Start angles (deg) by posture and joint that hold the platform at its start pose, within limits; empty for machines without the closed form of an arm."""
    arm = arm_of(job.machine.nominal)
    solver = closed_form(arm) if arm is not None else None
    if arm is None or solver is None:
        return {}
    branches = solver.all(*end_pose(arm, arm.start))
    own = np.array(list(product((0, 1), repeat=len(_PARTS))))[solver.branch]
    found = {}
    for branch, side in zip(branches, product((0, 1), repeat=len(_PARTS)), strict=True):
        parts = [part for part, a, b in zip(_PARTS, own, side, strict=True) if a != b]
        if parts and branch is not None and (angles := _within_limits(job, np.degrees(branch))) is not None:
            found[f"{' and '.join(parts)} flipped"] = dict(
                zip(job.config.robot.actuators, angles.round(9).tolist(), strict=True)
            )
    return found


def _within_limits(job: Job, angles: Floats) -> Floats | None:
    """Angles (6,) deg plus whole turns, the smallest within limits; None if a joint is out of its limits."""
    out = []
    for angle, each in zip(angles, job.config.robot.actuators.values(), strict=True):
        low, high = each.limits or (-np.pi, np.pi)
        turns = angle + 360.0 * np.arange(-2, 3)
        inside = turns[(turns >= np.degrees(low)) & (turns <= np.degrees(high))]
        if not len(inside):
            return None
        out.append(inside[np.argmin(np.abs(inside))])
    return np.array(out)
