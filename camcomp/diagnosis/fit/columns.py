"""Every way in which the runs could differ from the model, as columns: effects, nuisances, allowances, patterns.

Columns are in units of their own scale, so that priors read the same for all of them: an effect's scale is 1, its
tolerance what every healthy machine has of it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from camcomp.diagnosis.fit.bench import Bench, CandidateCause, cause_of, step_of, thinned
from camcomp.diagnosis.fit.labels import CLOCK_JITTER_S, EFFECT_OF, apart, label_name, scatter
from camcomp.diagnosis.fit.measured import channel_names
from camcomp.diagnosis.fit.starts import Nuisance, start_columns
from camcomp.diagnosis.model.noise import HEALTHY, MINOR, REPEATABILITY_MM
from camcomp.diagnosis.statistics.by_channel import ByChannel
from camcomp.diagnosis.statistics.evidence import Prior
from camcomp.ground import shelf
from camcomp.ground.datatypes import Floats, Ints
from camcomp.ground.errors import ConfigError
from camcomp.ground.progress import steps
from camcomp.model.axes import slides_of
from camcomp.model.effect import Parameter, applies
from camcomp.model.statics.description import Robot

RUN_OFFSET_N = 0.3
MOST_HEALTHY = 0.3  # of an effect's typical size


def candidate_causes(robot: Robot, without: Sequence[str] = ()) -> list[CandidateCause]:
    """All causes that the shelf knows for a machine."""
    cartesian = {axis for axis, _, _ in slides_of(robot)} == {0, 1, 2}
    found: list[CandidateCause] = []
    for name, effect in shelf.usable("effects", ("none", *without)):
        if getattr(effect, "ARM_ONLY", False) or not effect.PARAMETERS:
            continue
        if effect.TARGET in ("actuator", "either"):
            found += [
                CandidateCause(name, a.name, effect, a.revolute)
                for a in robot.actuators
                if not (a.revolute and getattr(effect, "SLIDES_ONLY", False))
            ]
        if effect.TARGET == "named" and (cartesian or not getattr(effect, "SLIDES_ONLY", False)):
            found += [CandidateCause(name, each, effect) for each in getattr(effect, "SOUGHT", effect.TARGETS)]
        slides = not any(a.revolute for a in robot.actuators)
        if effect.TARGET == "machine" or (
            effect.TARGET == "either" and (slides or not getattr(effect, "SLIDES_ONLY", False))
        ):
            found.append(CandidateCause(name, None, effect))
    return [each for each in found if applies(each.effect, robot, each.target)]


def working_causes(bench: Bench, candidates: Sequence[CandidateCause]) -> list[CandidateCause]:
    """Candidates without those effects of the user's own that fail on these runs; the machine file does not name them."""
    failed: set[str] = set()
    for each in candidates:
        if each.name in failed or shelf.is_own("effects", each.name):
            continue
        try:
            candidate_columns(bench, each, shape_default(each))
        except ConfigError as error:
            if error.rule != "CC281":
                raise
            shelf.warn_left_out(error.message)
            failed.add(each.name)
    return [each for each in candidates if each.name not in failed]


def first_guess(bench: Bench, candidate: CandidateCause) -> dict[str, float] | None:
    """Shapes from which an effect that has a `first_guess` begins, from set-points and encoders; None for other effects."""
    if not hasattr(candidate.effect, "first_guess"):
        return None
    j = bench.actuators.index(str(candidate.target))
    runs = []
    for run in bench.runs:
        if run.by == "setpoint" and run.run_path.ordered and run.encoders is not None:
            known = np.isfinite(run.encoders[:, j])
            runs.append((run.run_path.time[known], run.run_path.row_rho[known, j], run.encoders[known, j]))
    (shape,) = candidate.shapes
    return {**shape_default(candidate), shape.name: float(candidate.effect.first_guess(runs))}


@dataclass(frozen=True, eq=False)
class Columns:
    """k columns: candidate (k,) index of the candidate or -1, names (k,), prior, blocks per run (c n, k), without those of laws."""

    candidates: tuple[CandidateCause, ...]
    candidate: np.ndarray
    names: tuple[str, ...]
    prior: Prior
    blocks: tuple[ByChannel, ...]

    def of(self, candidate: int) -> list[int]:
        """Columns of an candidate."""
        return [int(i) for i in np.flatnonzero(self.candidate == candidate)]

    @cached_property
    def of_labels(self) -> Ints:
        """Columns by which clampings and clocks differ."""
        return np.flatnonzero(
            np.array([n.startswith(tuple(f"{each} " for each in EFFECT_OF)) for n in self.names], bool)
        )


def candidate_columns(bench: Bench, candidate: CandidateCause, shape: Mapping[str, float]) -> list[list[Floats]]:
    """Columns at nominal of an candidate's parameters, per run (n, c), in units of their scales; shape: scanned values."""
    key = (candidate.label, *sorted(shape.items()))
    if key in bench.columns:
        return bench.columns[key]
    out = []
    for p in candidate.parameters:
        after = cause_of(candidate, {**shape, p.name: step_of(p)})
        per_run = []
        for k in range(len(bench.runs)):
            change = bench.change(k, bench.read(k, [after]), bench.nominal[k])
            per_run.append(change * (p.scale / step_of(p)))
        out.append(per_run)
    if not candidate.shapes:
        bench.columns[key] = out
    return out


def shape_default(candidate: CandidateCause) -> dict[str, float]:
    """Nominal values of the shapes."""
    return {p.name: p.nominal for p in (*candidate.shapes, *candidate.switches)}


def build(
    bench: Bench,
    candidates: Sequence[CandidateCause],
    shapes: Mapping[int, Mapping[str, float]],
    floor_um: float,
) -> Columns:
    """All columns at nominal. Candidates that no channel can see have columns of zeros and stay.

    Every healthy machine has a little of everything: what moves the tip by HEALTHY of the noise floor is within tolerance,
    whatever other channels see of it; what moves it by more than MINOR of it is a cause. Nuisances reach as many of their
    tolerances: a healthy one goes beyond once in 5600.
    """
    found: list[tuple[int, int, Nuisance]] = []  # candidate, sign
    for i, candidate in enumerate(steps(candidates, len(candidates))):
        own = candidate_columns(bench, candidate, shapes.get(i, shape_default(candidate)))
        for p, per_run in zip(candidate.parameters, own, strict=True):
            size = healthy_size(bench, candidate, p, per_run, floor_um)
            found.append((i, p.sign, (f"{candidate.label}.{p.name}", size, per_run)))
    for name, size, per_run in _nuisances(bench):
        found.append((-1, 0, (name, size, per_run)))
    owner, sign, every = zip(*found, strict=True)
    names, tolerance, parts = zip(*every, strict=True)
    channels = range(6 + 2 * len(bench.actuators))
    blocks = tuple(
        ByChannel.of(np.stack([each[r][:, c] for each in parts], axis=1) for c in channels)
        for r in range(len(bench.runs))
    )
    bench.columns.clear()  # they stand in the blocks now
    prior = Prior(np.array(tolerance), np.array(sign, float), MINOR / HEALTHY * np.array(tolerance))
    return Columns(tuple(candidates), np.array(owner), names, prior, blocks)


def healthy_size(
    bench: Bench, candidate: CandidateCause, p: Parameter, per_run: Sequence[Floats], floor_um: float
) -> float:
    """Standard deviation of a parameter on healthy machines, in its scales; per_run: its columns (n, c)."""
    healthy = HEALTHY * floor_um / max(tip_um(bench, per_run), 1e-9)
    if any(each.placed for each in candidate.shapes):  # nothing happens for a while to every healthy machine
        healthy = min(healthy, p.tolerance / p.scale)
    return min(healthy, MOST_HEALTHY)


def tip_um(bench: Bench, per_run: Sequence[Floats]) -> float:
    """Rms (um, over rows of all runs) by which changes of the channels (n, c) per run move the tip.

    Changes at encoders count, although a model that follows logged encoders does not contain them.
    """
    whole = sum(float(np.sum(moved_tip(bench, k, each[:, :, None]) ** 2)) for k, each in enumerate(per_run))
    return 1e3 * float(np.sqrt(whole / max(sum(map(len, per_run)), 1)))


def moved_tip(bench: Bench, k: int, changes: Floats, rows: slice = slice(None)) -> Floats:
    """How far changes (n, c, j) of the channels of run k, or of some of its rows, move the tip (n, 3, j), mm, whatever channel
    shows them.

    Where the tip is the motion what lies along the path is when it was driven, and no error.
    """
    moved = changes[:, :3]
    if bench.runs[k].turn is not None:
        moved = moved * np.array([0.0, 1.0, 1.0])[:, None]
    if bench.runs[k].by == "setpoint" and bench.runs[k].measured.has("encoder"):
        ways = bench.thin_slopes[k][rows]
        moved = moved + ways @ changes[:, 3 : 3 + ways.shape[2]]
    return moved


def _nuisances(bench: Bench) -> list[Nuisance]:
    """Name, narrow size in units of the column, and column per run."""
    found: list[Nuisance] = []
    zero = [thinned(np.zeros_like(bench.observed(k)), run.thin) for k, run in enumerate(bench.runs)]

    def only(r: int, values: Floats) -> list[Floats]:
        return [values if k == r else zero[k] for k in range(len(zero))]

    m = len(bench.actuators)
    for r, run in enumerate(bench.runs):
        for c in range(6 + 2 * m):
            if 3 <= c < 3 + m or not np.isfinite(bench.observed(r)[:, c]).any():
                continue
            one = zero[r].copy()
            one[:, c] = 1.0
            torque = bench.levers[c - 3 - m] if 3 + m <= c < 3 + 2 * m else 1.0
            size = REPEATABILITY_MM if c < 3 else RUN_OFFSET_N * torque
            found.append((f"offset.{run.name}.{channel_names(bench.actuators)[c]}", size, only(r, one)))
    found += start_columns(bench, lambda r, values: only(r, thinned(values, bench.runs[r].thin)))
    clock = CandidateCause("time_sync", None, shelf.load("effects", "time_sync"))
    frame = CandidateCause("workpiece_frame", None, shelf.load("effects", "workpiece_frame"))
    if any(run.measured.has("tip") for run in bench.runs):
        ticks = candidate_columns(bench, clock, {})[0]
        scale = clock.parameters[0].scale
        for r, run in enumerate(bench.runs):
            second = ticks[r] / scale
            time = thinned(run.run_path.time[:, None], run.thin)
            found.append((f"clock.{run.name}", CLOCK_JITTER_S, only(r, second)))
            found.append((f"rate.{run.name}", CLOCK_JITTER_S, only(r, second * time)))
        _by_label(found, bench, "clock", [(clock.parameters[0].name, ticks)])
        frames = candidate_columns(bench, frame, {})
        _by_label(found, bench, "clamping", [(p.name, f) for p, f in zip(frame.parameters, frames, strict=True)])
    return found


def _by_label(found: list[Nuisance], bench: Bench, label: str, columns: Sequence[tuple[str, list[Floats]]]) -> None:
    """Free columns for every label that differs from others: only differences between labels are nuisances."""
    labels = [getattr(run, label) for run in bench.runs]
    for other in apart(labels):
        for name, per_run in columns:
            masked = [f if mine == other else 0.0 * f for mine, f in zip(labels, per_run, strict=True)]
            found.append((label_name(label, other, name), np.inf, masked))


def with_scatter(columns: Columns, bench: Bench, amplitude: Floats) -> Columns:
    """The columns with the tolerance of labels set to the scatter of their offsets; amplitude (k,): of all columns."""
    tolerance = columns.prior.tolerance.copy()
    for label, effect in EFFECT_OF.items():
        labels = [getattr(run, label) for run in bench.runs]
        if len(set(labels)) < 2 or None in labels:  # they differ from what the runs without one share
            continue
        first = {each: next(run for run in bench.runs if getattr(run, label) == each) for each in apart(labels)}
        for p in CandidateCause(effect, None, shelf.load("effects", effect)).parameters:
            mine = [columns.names.index(label_name(label, each, p.name)) for each in first]
            taken_up = np.array([run.run_path.clock_s if label == "clock" else 0.0 for run in first.values()])
            tolerance[mine] = max(scatter(amplitude[mine] + taken_up / p.scale), p.tolerance / p.scale)
    return replace(columns, prior=replace(columns.prior, tolerance=tolerance))
