"""Region of the runs, and the region of feasible experiments: travel, singular poses, obstacles below."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from camcomp.diagnosis.fit.bench import Bench, Run
from camcomp.diagnosis.fit.patterns import KINDS
from camcomp.ground.datatypes import RAPID, Bools, Floats
from camcomp.ground.errors import PhysicsError
from camcomp.model.job import Job
from camcomp.model.motion.twin import Twin

STRETCH = 2.5  # largest ratio of the tip's motion per drive motion to that of the runs (nearness to singular poses)
FARTHER = 2.0  # half widths of the work: largest distance of an experiment
RADII_MM = (3.0, 40.0)  # of a circle in the region of work
_STEPS = 8  # samples of a straight line in the search for its end
_DIFFERENCE_MM = 0.01
_POSES = 40  # samples of the runs for STRETCH
USUAL_FEED = 1000.0  # mm/min, default


@dataclass(frozen=True, eq=False)
class WorkPlace:
    """Centre (3,) mm, half widths (3,) mm and feed mm/min of the work in a region."""

    centre: Floats
    half: Floats
    feed: float

    @property
    def radius(self) -> float:
        """Radius of a circle in the region, mm."""
        return round(float(np.clip(np.min(self.half[:2]), *RADII_MM)), 1)


@dataclass(frozen=True, eq=False, kw_only=True)
class Site:
    """Regions and channels of the runs, and what the machine reaches.

    work: of all runs; cut: of cutting, or None. low: height above which there are no obstacles, mm; end: of the last run, s on
    the common clock; channels: logged ones; limits: (m, 2) of the actuators; stretch: largest motion of the tip per motion of the
    drives.
    """

    work: WorkPlace
    cut: WorkPlace | None
    low: float
    end: float
    channels: tuple[str, ...]
    twin: Twin
    limits: Floats
    stretch: float

    @property
    def farther(self) -> float:
        """Largest distance of an experiment from the centre of the work, mm."""
        return FARTHER * float(max(self.work.half.max(), RADII_MM[1]))

    def holds(self, points: Floats) -> bool:
        """Whether points (n, 3) of an experiment are within reach of the machine and within `farther` of the work."""
        near = np.abs(points - self.work.centre).max() <= self.farther + self.work.half.max()
        return bool(near and self._allowed(points).all())

    def reaches(self, start: Floats, directions: Floats) -> Floats:
        """Lengths (k,) mm, at most `farther`, of straight lines from `start` (3,) along unit directions (k, 3) within reach and above
        `low`.
        """
        far = self.farther * np.arange(1, _STEPS + 1) / _STEPS
        points = start + far[None, :, None] * directions[:, None, :]
        good = self._allowed(points.reshape(-1, 3)).reshape(len(directions), _STEPS)
        good &= points[:, :, 2] >= self.low - _DIFFERENCE_MM
        return np.asarray(self.farther * np.cumprod(good, axis=1).sum(axis=1) / _STEPS, float)

    def _allowed(self, points: Floats) -> Bools:
        """Mask (n,) of points (n, 3), program frame, within travel and not nearer to singular poses than `stretch` says."""
        try:
            rho = self.twin.inverse(self.twin.to_machine(points))
            near = _stretch(self.twin, points) <= self.stretch
        except PhysicsError:  # of one of them
            half = len(points) // 2
            if half == 0:
                return np.zeros(1, bool)
            return np.concatenate([self._allowed(points[:half]), self._allowed(points[half:])])
        inside = np.isfinite(rho) & (rho >= self.limits[:, 0]) & (rho <= self.limits[:, 1])
        return np.asarray(inside.all(axis=1) & near)


def site_of(bench: Bench, job: Job) -> Site:
    """The site of the runs of a bench on the machine of a job."""
    each = [run.commanded(bench.twin) for run in bench.runs]
    tips = np.concatenate(each)
    some = tips[np.unique(np.linspace(0, len(tips) - 1, _POSES).astype(int))]
    loaded = [np.abs(run.run_path.row_force).sum(axis=1) > 0.0 for run in bench.runs]
    every = np.concatenate(loaded)
    feeds = [run.run_path.feed_mm_per_min for run in bench.runs]
    cutting = [f for f, load in zip(feeds, loaded, strict=True) if load.any()]
    return Site(
        work=_place(tips, feeds), cut=_place(tips[every], cutting) if every.any() else None,
        low=_low(bench, each, loaded), twin=bench.twin, limits=np.array(job.machine.limits, float),
        stretch=STRETCH * float(_stretch(bench.twin, some).max()),
        end=max(run.run_path.started + float(run.run_path.time[-1]) for run in bench.runs),
        channels=tuple(c for c in KINDS if any(run.measured.has(c) for run in bench.runs)),
    )  # fmt: skip


def _place(tips: Floats, feeds: list[float]) -> WorkPlace:
    low, high = np.quantile(tips, 0.02, axis=0), np.quantile(tips, 0.98, axis=0)
    known = [f for f in feeds if np.isfinite(f)]
    feed = round(float(np.median(known))) if known else USUAL_FEED
    return WorkPlace(np.round(0.5 * (low + high), 1) + 0.0, 0.5 * (high - low), feed)


def _low(bench: Bench, tips: list[Floats], loaded: list[Bools]) -> float:
    """Height (mm) above which the tool moved freely: of runs without cutting, else of rapids, else the top of all runs."""
    free = [tip[:, 2].min() for tip, load in zip(tips, loaded, strict=True) if not load.any()]
    if free:
        return round(float(min(free)), 1)
    crossed = [z for run in bench.runs for z in _crossings(run)]
    return float(min(crossed)) if crossed else float(max(tip[:, 2].max() for tip in tips))


def _crossings(run: Run) -> Floats:
    """Heights of lateral rapids, mm."""
    path = run.program
    if path is None or len(path) < 2:
        return np.zeros(0)
    across = np.linalg.norm((path.end - path.start)[:, :2], axis=1) > 0.0
    rapid = (path.kind == RAPID) & path.known & ~path.machine & across
    rapid[1:] &= path.known[:-1]  # from a known position
    rapid[0] = False
    return np.asarray(np.minimum(path.start, path.end)[rapid, 2], float)


def _stretch(twin: Twin, points: Floats) -> Floats:
    """Largest motion (n,) of the tip per motion of the drives at points (n, 3), by differences of the inverse kinematics."""
    moved = np.concatenate([points + s * _DIFFERENCE_MM * axis for axis in np.eye(3) for s in (1.0, -1.0)])
    rho = twin.inverse(twin.to_machine(moved)).reshape(3, 2, len(points), -1)
    slopes = np.moveaxis((rho[:, 0] - rho[:, 1]) / (2.0 * _DIFFERENCE_MM), 0, 2)  # (n, m, 3)
    return np.asarray(1.0 / np.maximum(np.linalg.svd(slopes, compute_uv=False)[:, -1], 1e-12), float)
