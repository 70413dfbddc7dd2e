"""What to measure next on a single axis: strokes there and back, chosen for what they tell of what a leftover goes with.

Each covariate that the leftover may be a function of is a hypothesis, and so is that nothing is left where the rows were too few to
say. A block of strokes has a place, a length and a speed inside what the runs had. Two hypotheses are told apart by what any
function of the one leaves once a function of the other is fitted; the gain is the expected fall of the entropy over them,
less the price of the time. Blocks are taken one by one while that grows.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import product

import numpy as np

from camcomp.diagnosis.axis.at_tip import lever_mm
from camcomp.diagnosis.axis.findings import AxisFindings, AxisRun
from camcomp.diagnosis.axis.gate import STRETCH_S
from camcomp.diagnosis.axis.terms import travel
from camcomp.diagnosis.model.noise import AT_FLOOR
from camcomp.diagnosis.next_experiment.design import SETUP_MIN
from camcomp.diagnosis.next_experiment.proposal import PRICE, WORTH
from camcomp.diagnosis.result.types import UNKNOWN, AxisMoves, NextExperiment, StrokeBlock
from camcomp.diagnosis.statistics.expected_gain import expected_gain
from camcomp.ground.datatypes import Floats

BLOCK_S = 20.0  # of strokes; one there and back at least
LONGEST_S = 60.0  # of one there and back
LENGTHS = (1.0, 0.3, 0.05)  # of the travel that the runs had
SPEEDS = (0.05, 0.2, 0.5, 1.0)  # of the speed that they had
REST_S = 0.2  # at either end of a stroke
USED = 0.99  # quantile of what the runs had that strokes may have
LEAST_WEIGHT = 0.1  # of a covariate that the leftover does not seem to go with
ROWS = 400  # of a foreseen motion
STEPS = 12  # of a function of a covariate
_NOTHING = "nothing"
_MEANS = {
    "position": "If what is left of {0} is the same at the same place in every stroke, it goes with the position: screw, scale or guide.",
    "velocity": "If it changes with the speed, or from one way to the other, it goes with the velocity: friction or the loop.",
    "acceleration": "If it stands only where the axis speeds up or slows down, it goes with the acceleration: mass or the loop's gain.",
    "time": "If it changes from stroke to stroke, it goes with time: warmth, or what else the machine does.",
}


def next_moves(
    found: Sequence[AxisFindings], runs: Mapping[str, Sequence[AxisRun]], verdict: str
) -> NextExperiment | None:
    """Strokes of the axis with the largest residual; None where machine and model agree, or all axes stood still."""
    if verdict not in (UNKNOWN, "ambiguous"):
        return None
    asked = [a for a in found if a.strange] or found  # something unknown is asked of the axes that show it
    for axis in sorted(asked, key=_left, reverse=True):
        logs = [run for run in runs[axis.name] if np.isfinite(run.encoder).sum() > 2 * axis.wide + 1]
        designed = _designed(axis, logs, verdict)
        if designed is not None:
            moves, bits = designed
            return NextExperiment(
                action=_action(moves),
                separates=(UNKNOWN,),
                gain=round(bits, 4),
                minutes=round(_minutes(moves), 1),
                outcomes=_outcomes(axis, verdict),
                moves=moves,
            )
    return None


def set_points(moves: AxisMoves) -> tuple[Floats, Floats]:
    """Times (n,) s and set-points (n,) of the strokes one after the other, from the first one's low end."""
    at, parts = moves.blocks[0].low, []
    for block in moves.blocks:
        for target in (block.low, *(block.high, block.low) * block.times):
            parts += [
                _way(at, target, block.speed, moves.acceleration, moves.step_s),
                np.full(_rows(REST_S, moves), target),
            ]
            at = target
    place: Floats = np.concatenate(parts)
    return moves.step_s * np.arange(len(place), dtype=float), place


def stroke_table(moves: AxisMoves) -> str:
    """The set-points as CSV, a row every `step_s`, with the columns of logs: `t_s`, `cmd_<a>_mm` (`_rad`)."""
    time, place = set_points(moves)
    rows = (f"{t:.6f},{at:.6f}\n" for t, at in zip(time.tolist(), (place + 0.0).tolist(), strict=True))
    return f"t_s,cmd_{moves.axis}_{moves.unit}\n{''.join(rows)}"


def _left(axis: AxisFindings) -> float:
    """How far above their floors the channels are."""
    return max((c.squares[1] / max(c.floor, 1e-12) ** 2 for c in axis.channels), default=0.0)


def _designed(axis: AxisFindings, logs: Sequence[AxisRun], verdict: str) -> tuple[AxisMoves, float] | None:
    """Strokes and their expected information, bits."""
    if not logs:
        return None
    seen = [travel(run.time, run.encoder, axis.wide) for run in logs]
    position, speed, push = (
        np.concatenate([getattr(at, part) for at in seen]) for part in ("position", "speed", "acceleration")
    )
    low, high = (float(np.quantile(position, q)) for q in (1.0 - USED, USED))
    fastest, hardest = (float(np.quantile(np.abs(each), USED)) for each in (speed, push))
    step = float(np.median(np.concatenate([np.diff(run.time) for run in logs])))
    if not (high - low > 0.0 and fastest > 0.0 and hardest > 0.0 and step > 0.0):
        return None
    bins = {"position": _bins(position), "velocity": _bins(speed), "acceleration": _bins(push)}
    weight = _weights(axis, verdict)
    kinds, probability = tuple(weight), np.array([*weight.values()]) / sum(weight.values())
    size = 1.0 if verdict == UNKNOWN else np.sqrt(AT_FLOOR - 1.0)  # it may be no larger there than the floor
    blank = AxisMoves(
        axis=axis.name, unit="rad" if logs[0].revolute else "mm", blocks=(), acceleration=_tidy(hardest), step_s=step
    )
    best, bits, value = blank, 0.0, 0.0
    while True:
        found = []
        for block in _blocks(low, high, fastest, hardest):
            moves = blank.model_copy(update={"blocks": (*best.blocks, block)})
            gain = expected_gain(_apart(moves, kinds, bins, float(size)), probability)
            found.append((gain - PRICE * _minutes(moves), gain, moves))
        better = max(found, key=lambda each: each[0])
        if better[0] <= value:
            break
        value, bits, best = better
    return (_in_own_unit(best), bits) if best.blocks and bits > WORTH else None


def _in_own_unit(moves: AxisMoves) -> AxisMoves:
    """Strokes of a hinge in rad, which the study has in mm at the end of its arm."""
    if moves.unit == "mm":
        return moves
    lever = lever_mm(True)
    blocks = tuple(
        b.model_copy(update={"low": b.low / lever, "high": b.high / lever, "speed": b.speed / lever})
        for b in moves.blocks
    )
    return moves.model_copy(update={"blocks": blocks, "acceleration": moves.acceleration / lever})


def _weights(axis: AxisFindings, verdict: str) -> dict[str, float]:
    """Hypotheses with their weights: covariates by the share of the leftover that goes with them."""
    out = dict.fromkeys(_MEANS, LEAST_WEIGHT)
    found = [(kind, share) for kind, of, share in _depends_on(axis) if of == axis.name]
    if axis.ripple is not None:
        found.append(("position", axis.ripple.share))
    for kind, share in found:
        kind = "velocity" if kind == "reversal" else kind  # strokes of any speed turn round
        out[kind] = max(out[kind], share)
    return out if verdict == UNKNOWN else out | {_NOTHING: sum(out.values())}


def _depends_on(axis: AxisFindings) -> list[tuple[str, str, float]]:
    """Kind of covariate, its axis, and the share of the residual that depends on it."""
    parted = [(name.partition(":"), share) for name, share in axis.unknown_in]
    return [(kind, of, share) for (kind, _, of), share in parted]


def _blocks(low: float, high: float, fastest: float, hardest: float) -> Iterator[StrokeBlock]:
    """Strokes between two ends of the travel, as fast and as sudden as the runs at most."""
    for length, rate in product(LENGTHS, SPEEDS):
        for start in (0.0,) if length == 1.0 else (0.0, 0.5 * (1.0 - length), 1.0 - length):
            ends = low + start * (high - low), low + (start + length) * (high - low)
            speed = rate * fastest
            once = 2.0 * ((ends[1] - ends[0]) / speed + speed / hardest + REST_S)
            if once <= LONGEST_S:
                times = max(round(BLOCK_S / once), 1)
                yield StrokeBlock(low=_tidy(ends[0]), high=_tidy(ends[1]), speed=_tidy(speed), times=times)


def _apart(moves: AxisMoves, kinds: Sequence[str], bins: Mapping[str, Floats], size: float) -> Floats:
    """Chi-square (r, r) by which hypothesis j misses a residual of `size` floors that is a function of i.

    bins: limits between which a function of a covariate is constant, from the runs. A stretch of time counts once.
    """
    time, place = set_points(moves)
    some = np.unique(np.linspace(0, len(time) - 1, ROWS).astype(int))
    speed = np.gradient(place, time)
    over = {"position": place, "velocity": speed, "acceleration": np.gradient(speed, time), "time": time}
    functions = {
        kind: _steps(over[kind][some], bins[kind] if kind in bins else _bins(time))
        for kind in kinds
        if kind != _NOTHING
    }
    out = np.zeros((len(kinds), len(kinds)))
    for (i, one), (j, other) in product(enumerate(kinds), repeat=2):
        if i != j:
            real = functions[other if one == _NOTHING else one]
            rest = real
            if _NOTHING not in (one, other):
                base = np.linalg.qr(functions[other])[0]
                rest = real - base @ (base.T @ real)
            out[i, j] = float((rest**2).sum()) / len(some) * size**2 * time[-1] / STRETCH_S
    return out


def _bins(values: Floats) -> Floats:
    """Edges between values (n,) of equally many rows."""
    return np.unique(np.quantile(values, np.linspace(0.0, 1.0, STEPS + 1)[1:-1]))


def _steps(values: Floats, edges: Floats) -> Floats:
    """Steps (n, k) of values (n,) between edges, without their means."""
    steps = (np.searchsorted(edges, values)[:, None] == np.arange(len(edges) + 1)).astype(float)
    return np.asarray(steps - steps.mean(axis=0))


def _way(start: float, end: float, speed: float, acceleration: float, step: float) -> Floats:
    """Set-points (n,) of one stroke between standstills, trapezoidal in speed."""
    length = abs(end - start)
    if length == 0.0:
        return np.zeros(0)
    speed = min(speed, float(np.sqrt(length * acceleration)))
    ramp = speed / acceleration
    whole = length / speed + ramp
    t = np.append(np.arange(0.0, whole, step), whole)
    up, down = np.minimum(t, ramp), np.minimum(whole - t, ramp)
    steady = np.clip(t - ramp, 0.0, whole - 2.0 * ramp)
    way = 0.5 * acceleration * (up**2 + ramp**2 - down**2) + speed * steady
    return np.asarray(start + np.sign(end - start) * way)


def _rows(seconds: float, moves: AxisMoves) -> int:
    return max(round(seconds / moves.step_s), 1)


def _minutes(moves: AxisMoves) -> float:
    return SETUP_MIN + float(set_points(moves)[0][-1]) / 60.0


def _tidy(value: float) -> float:
    return float(f"{value:.3g}")


def _action(moves: AxisMoves) -> str:
    each = [
        f"{block.times} x from {block.low:g} to {block.high:g} {moves.unit} and back at {block.speed:g} {moves.unit}/s"
        for block in moves.blocks
    ]
    return f"move {moves.axis} alone and log it: {'; '.join(each)} (set-points: --next-program OUT.csv)"


def _outcomes(axis: AxisFindings, verdict: str) -> tuple[str, ...]:
    if verdict == "ambiguous":
        names = " and ".join(dict.fromkeys(cause.effect for cause in axis.causes)) or "nothing but noise"
        return (
            f"If these strokes leave no more than the noise, {names} is all that acts on {axis.name}.",
            "If they leave more, something acts on it that no effect of the library explains.",
        )
    weight = _weights(axis, verdict)
    others = dict.fromkeys(of for _, of, _ in _depends_on(axis) if of != axis.name)
    return (
        *(f"If nothing is left of {axis.name} when it moves alone, it goes with how {of} moves." for of in others),
        *(_MEANS[kind].format(axis.name) for kind in sorted(weight, key=lambda each: -weight[each])),
    )
