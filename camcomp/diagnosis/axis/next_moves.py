"""What to measure next on a single axis: strokes there and back, chosen for their expected information.

A block of strokes has a place, a length and a speed inside what the runs had. What is left of the axis may be any function of
its position, speed and acceleration; the blocks that tell most of all of these together are proposed (`model/design.py`).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import product

import numpy as np

from camcomp.diagnosis.axis.findings import AxisFindings, AxisRun, lever_mm
from camcomp.diagnosis.axis.gate import STRETCH_S
from camcomp.diagnosis.axis.plausible import MIDDLE
from camcomp.diagnosis.axis.terms import travel
from camcomp.diagnosis.model.design import designed
from camcomp.diagnosis.model.discrepancy import smooth_functions
from camcomp.diagnosis.next_experiment.design import SETUP_MIN
from camcomp.diagnosis.result.types import UNKNOWN, AxisMoves, NextExperiment, StrokeBlock
from camcomp.ground.datatypes import Floats
from camcomp.model.motion.timeline import trapezoid, trapezoid_duration

BLOCKS = 4  # of a proposal
BLOCK_S = 60.0  # of strokes, one there and back at least: four minutes of a proposal
LENGTHS = (1.0, 0.3, 0.05)  # of the travel that the runs had
SPEEDS = (0.05, 0.2, 0.5, 1.0)  # of the speed that they had
ROWS_OF_BLOCK = 400  # of a block of strokes whose functions are worked out
REST_S = 0.2  # at either end of a stroke
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
    above = {a.name: max((c.squares[1] / max(c.floor, 1e-12) ** 2 for c in a.channels), default=0.0) for a in asked}
    for axis in sorted(asked, key=lambda a: above[a.name], reverse=True):
        logs = [run for run in runs[axis.name] if np.isfinite(run.encoder).sum() > 2 * axis.wide + 1]
        designed = _designed(axis, logs)
        if designed is not None:
            moves, bits = designed
            return NextExperiment(
                action=_action(moves), separates=(UNKNOWN,), gain=round(bits, 4),
                minutes=round(SETUP_MIN + float(set_points(moves)[0][-1]) / 60.0, 1),
                outcomes=_outcomes(axis, verdict), moves=moves,
            )  # fmt: skip
    return None


def set_points(moves: AxisMoves) -> tuple[Floats, Floats]:
    """Times (n,) s and set-points (n,) of the strokes one after the other, from the first one's low end."""
    at, parts = moves.blocks[0].low, []
    for block in moves.blocks:
        for target in (block.low, *(block.high, block.low) * block.times):
            parts += [
                _way(at, target, block.speed, moves.acceleration, moves.step_s),
                np.full(max(round(REST_S / moves.step_s), 1), target),
            ]
            at = target
    place: Floats = np.concatenate(parts)
    return moves.step_s * np.arange(len(place), dtype=float), place


def stroke_table(moves: AxisMoves) -> str:
    """The set-points as CSV, a row every `step_s`, with the columns of logs: `t_s`, `cmd_<a>_mm` (`_rad`)."""
    time, place = set_points(moves)
    rows = (f"{t:.6f},{at:.6f}\n" for t, at in zip(time.tolist(), (place + 0.0).tolist(), strict=True))
    return f"t_s,cmd_{moves.axis}_{moves.unit}\n{''.join(rows)}"


def _designed(axis: AxisFindings, logs: Sequence[AxisRun]) -> tuple[AxisMoves, float] | None:
    """Strokes in the unit of the axis and their expected information, bits; None where the runs do not move."""
    if not logs:
        return None
    lever = lever_mm(axis.revolute)
    seen = [travel(run.time, run.encoder / lever, axis.wide) for run in logs]
    position, speed, push = (
        np.concatenate([getattr(at, part) for at in seen]) for part in ("position", "speed", "acceleration")
    )
    low, high = np.quantile(position, MIDDLE).tolist()
    fastest, hardest = (float(np.quantile(np.abs(each), MIDDLE[1])) for each in (speed, push))
    step = float(np.median(np.concatenate([np.diff(run.time) for run in logs])))
    if not (high - low > 0.0 and fastest > 0.0 and hardest > 0.0 and step > 0.0):
        return None
    blank = AxisMoves(
        axis=axis.name, unit="rad" if axis.revolute else "mm", blocks=(), acceleration=_tidy(hardest), step_s=step
    )
    blocks = list(_blocks(low, high, fastest, hardest))
    ends = (low, high), (-fastest, fastest), (-hardest, hardest)
    rows = [_functions(blank.model_copy(update={"blocks": (each,)}), ends) for each in blocks]
    if not rows:
        return None
    design = designed(np.array(rows), np.eye(rows[0].shape[1]), BLOCKS)
    return blank.model_copy(update={"blocks": tuple(blocks[i] for i in design.chosen)}), design.gain


def _functions(moves: AxisMoves, ends: Sequence[tuple[float, float]]) -> Floats:
    """Functions (n, k) of position, speed and acceleration of strokes, one floor in size; a stretch of time counts once."""
    time, place = set_points(moves)
    speed = np.gradient(place, time)
    some = np.linspace(0, len(time) - 1, ROWS_OF_BLOCK).astype(int)
    motion = place, speed, np.gradient(speed, time)
    each = [smooth_functions(values[some], *own) for values, own in zip(motion, ends, strict=True)]
    return np.asarray(np.hstack(each) * np.sqrt(time[-1] / STRETCH_S / len(some)), float)


def _blocks(low: float, high: float, fastest: float, hardest: float) -> Iterator[StrokeBlock]:
    """Strokes between two ends of the travel, as fast and as sudden as the runs at most."""
    for length, rate in product(LENGTHS, SPEEDS):
        for start in (0.0,) if length == 1.0 else (0.0, 0.5 * (1.0 - length), 1.0 - length):
            ends = low + start * (high - low), low + (start + length) * (high - low)
            speed = rate * fastest
            once = 2.0 * ((ends[1] - ends[0]) / speed + speed / hardest + REST_S)
            if once <= BLOCK_S:
                times = int(BLOCK_S / once)
                yield StrokeBlock(low=_tidy(ends[0]), high=_tidy(ends[1]), speed=_tidy(speed), times=times)


def _way(start: float, end: float, speed: float, acceleration: float, step: float) -> Floats:
    """Set-points (n,) of one stroke between standstills, trapezoidal in speed."""
    length = abs(end - start)
    if length == 0.0:
        return np.zeros(0)
    whole = float(trapezoid_duration(length, speed, acceleration))
    t = np.append(np.arange(0.0, whole, step), whole)
    return np.asarray(start + np.sign(end - start) * trapezoid(t, whole, length, speed, acceleration))


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
    found = [(*name.partition(":")[::2], share) for name, share in axis.unknown_in]
    found += [] if axis.ripple is None else [("position", axis.name, axis.ripple.share)]
    share = dict.fromkeys(_MEANS, 0.0)
    for kind, of, own in found:
        kind = "velocity" if kind == "reversal" else kind  # strokes of any speed turn round
        share[kind] = max(share[kind], own) if of == axis.name else share[kind]
    return (
        *(
            f"If nothing is left of {axis.name} when it moves alone, it goes with how {of} moves."
            for of in dict.fromkeys(of for _, of, _ in found if of != axis.name)
        ),
        *(_MEANS[kind].format(axis.name) for kind in sorted(share, key=lambda each: -share[each])),
    )
