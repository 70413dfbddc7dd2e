"""The noise of a bench's channels: that of its instruments, and by how much single rows are less certain."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from camcomp.diagnosis.fit.bench import Bench, Run, per_force, thinned
from camcomp.diagnosis.fit.floor import NoiseFloor, row_scatter, steady_scatter
from camcomp.diagnosis.fit.outliers import tails
from camcomp.diagnosis.fit.starts import unknown_starts
from camcomp.diagnosis.model.noise import instants_apart, rounding_noise
from camcomp.diagnosis.statistics.noise_model import Noise
from camcomp.ground.datatypes import Floats

TIMING_S = 0.0015  # how fast a real drive settles after its acceleration has stepped
UNSTEADY_S = 0.002  # more jitter than any log has
REMEMBERED_S = 1.0  # for which slow noise lasts


def instrument_noise(bench: Bench, floor: NoiseFloor, least: Floats, times: Sequence[Floats]) -> Noise:
    """Noise per run and channel from the scatter of its rows, independent of the residual of any fit.

    Slow noise of the tip is the stated floor. Slow noise of other instruments equals their fast noise; for a
    dynamometer that of its quietest run, because teeth excite it in the cut.
    """
    runs, c = len(bench.runs), len(floor.fast)
    sigma = np.full((runs, c), np.nan)
    scatter = [np.array([row_scatter(x, t) for x in bench.residual(k).T]) for k, t in enumerate(times)]
    quietest = np.min(np.where(np.nan_to_num(scatter) > 0.0, scatter, np.inf), axis=0)
    quietest[: c - 3] = np.inf
    slow, memory = np.zeros((runs, c)), np.zeros((runs, c))
    for k in range(runs):
        gap = bench.residual(k)
        known = np.isfinite(gap).any(axis=0)
        own = scatter[k]
        fast = np.where(np.isfinite(own), own, floor.fast)
        usual = np.where(np.isfinite(floor.fast), floor.fast, 0.0)
        fast = np.maximum(np.clip(np.where(np.isfinite(fast), fast, 0.0), 0.5 * usual, 2.0 * usual), least)
        lasting = np.where(np.arange(c) < 3, floor.slow_mm, np.clip(quietest, least, fast))
        whole = np.hypot(fast, lasting)
        step = float(np.median(np.diff(times[k]))) if len(times[k]) > 1 else 1.0
        sigma[k] = np.where(known, whole, np.nan)
        if bench.runs[k].run_path.ordered:
            slow[k], memory[k] = (lasting / whole) ** 2, np.exp(-step / REMEMBERED_S)
    return Noise(sigma, slow, memory, [], times)


def with_doubt(noise: Noise, bench: Bench) -> Noise:
    """The noise with by how much every row is less certain than its channel."""
    every = zip(inflation(bench), noise.sigma, tails(bench), strict=True)
    return replace(noise, inflate=[np.sqrt(1.0 + (extra / own) ** 2) * heavy for extra, own, heavy in every])


def inflation(bench: Bench) -> list[Floats]:
    """Per run (n, c) >= 1: rows just after a step of the acceleration or after an unknown motion count less; NaN where no value.

    In units of the channel's own noise, which is not known yet: here the extra standard deviation in mm or N.
    """
    out = []
    unsteady, late = jitter(bench), _late(bench)
    for k, run in enumerate(bench.runs):
        observed = bench.observed(k)
        extra = np.zeros_like(observed)
        t = run.run_path.time
        if run.run_path.ordered and len(t) > 4:
            change, between = _changes(run), rounding_noise(float(np.median(np.diff(t))))
            slope = np.abs(bench.row_slopes[k])
            # a late drive stands behind by its speed, and a tip is read at one, that the rows lack
            of_drives = (TIMING_S**2 + late * between) * change
            extra[:, :3] = np.einsum("nij,nj->ni", slope, of_drives + run.run_path.between_s * between * change)
            extra[:, bench.parts["encoder"]] = of_drives
            if unsteady > 0.0:
                extra[:, :3] = np.hypot(extra[:, :3], unsteady * np.abs(_speed(bench, k)))
        extra = np.hypot(np.hypot(extra, _doubt(bench, k)), unknown_starts(bench, k))
        extra = np.where(np.isfinite(observed), extra, np.nan)
        out.append(thinned(extra, run.thin))
    return out


def _changes(run: Run) -> Floats:
    """By how much (n, m) the drives' acceleration changes around each row."""
    t, grid = run.run_path.time, run.run_path.grid
    usual = float(np.median(np.diff(t)))
    push = np.gradient(np.gradient(run.run_path.grid_rho, grid, axis=0), grid, axis=0)
    steps = np.linspace(-max(1.5 * usual, 0.02), 0.5 * usual, 21)
    around = [np.column_stack([np.interp(t + d, grid, v) for v in push.T]) for d in steps]
    return np.asarray(np.ptp(np.stack(around), axis=0))


def _late(bench: Bench) -> Floats:
    """Delay (m,), s, of the drives behind their set-points, by the encoders in fast rows; 0 where unknown."""
    behind: list[list[Floats]] = [[] for _ in bench.actuators]
    for k, run in enumerate(bench.runs):
        path = run.run_path
        if not path.ordered or len(path.time) < 3:
            continue
        gap = bench.off(k)[:, bench.parts["encoder"]]
        speed = np.gradient(path.grid_rho, path.grid, axis=0)
        for j, late in enumerate(behind):
            v = np.interp(path.time, path.grid, speed[:, j])
            fast = np.isfinite(gap[:, j]) & (np.abs(v) > float(np.mean(np.abs(v))))
            late.append(-gap[fast, j] / v[fast])
    return np.array([max(float(np.median(np.concatenate([*each, [0.0]]))), 0.0) for each in behind])


def _doubt(bench: Bench, k: int) -> Floats:
    """Standard deviations (n, c) of the channels by the uncertainty of the cutting force."""
    run = bench.runs[k]
    out = np.zeros_like(bench.observed(k))
    if run.run_path.driven is None or not run.run_path.driven.doubt.any():
        return out
    force = run.run_path.driven.doubt
    slopes, tool = bench.slopes[k].at(run.run_path.row_place), bench.twin.nominal.tool
    # each axis of the force may be off by itself
    tips = np.moveaxis(per_force(slopes.tip_wrench, tool) * force[:, None], 2, 0) @ bench.twin.rotation
    out[:, :3] = np.linalg.norm([bench.turned(k, each) for each in tips], axis=0)
    out[:, bench.parts["drive"]] = np.linalg.norm(per_force(slopes.drive_wrench, tool) * force[:, None], axis=2)
    out[:, bench.parts["dyno"]] = force
    return np.abs(out)


def jitter(bench: Bench) -> float:
    """Standard deviation, s, of the instants at which the tip was really read, from noise that grows with the speed; at most
    UNSTEADY_S.
    """
    gaps, speeds, noise = list[Floats](), list[Floats](), list[float]()
    for k, run in enumerate(bench.runs):
        if run.run_path.ordered:
            gap, time = bench.off(k)[:, :3].T, run.run_path.time
            gaps, speeds = [*gaps, *gap], [*speeds, *_speed(bench, k).T]
            noise += [each for x in gap if np.isfinite(each := steady_scatter(x, time))]
    return min(instants_apart(gaps, speeds, float(np.median(noise or [np.inf]))), UNSTEADY_S)


def _speed(bench: Bench, k: int) -> Floats:
    """Velocity (n, 3) of the modelled tip in run k, mm/s."""
    t = bench.runs[k].run_path.time
    return np.gradient(bench.channels(k, bench.nominal[k])[:, :3], t, axis=0)
