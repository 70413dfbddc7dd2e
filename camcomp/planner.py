"""Which experiment to do next: the one that best separates the causes that are still alike, per minute of machine time.

Every candidate is a small NC program (or a further channel on a program already run). Its logs are foreseen by the
twin for each rival; the gain is the fall of the entropy between the rivals. Source: expected information gain over
hypotheses at their fitted sizes (Chaloner and Verdinelli, Statistical Science 10, 1995), with the evidence of the
diagnosis itself as posterior.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from camcomp.bench import Bench, Run
from camcomp.columns import RUN_OFFSET_MM, atom_columns, shape_default
from camcomp.course import course_of_program
from camcomp.cutting.track import lay_track
from camcomp.datatypes import Floats
from camcomp.diagnostics import CamcompError
from camcomp.gap.evidence import Gram
from camcomp.gap.observation import Measured
from camcomp.gap.search import Fitted, Scale, total
from camcomp.gap.timeline import schedule
from camcomp.gcode.interpret import read_program
from camcomp.inquiry import Inquiry
from camcomp.job import Job

_STEP_S = 0.02
_SETUP_MIN = 1.0
_NEW_CHANNEL_MIN = 5.0
_LATER_MIN = 60.0
_WORTH = 0.02  # bits below which an experiment is not worth proposing
_CHANNELS = ("tip", "encoder", "drive", "dyno")
_NEEDS = {"encoder": "the encoders", "drive": "the drive forces", "dyno": "the force on the tool with a dynamometer"}


@dataclass(frozen=True, eq=False)
class Candidate:
    """A feasible experiment. program: NC text; channels: what it logs; minutes: what it costs."""

    action: str
    program: str
    cutting: bool
    channels: tuple[str, ...]
    started: float
    minutes: float


@dataclass(frozen=True, eq=False)
class Proposal:
    """The best candidate, its gain in bits, the effects that it separates."""

    candidate: Candidate
    gain: float
    separates: tuple[str, ...]


def propose(inquiry: Inquiry, rivals: Sequence[Fitted], probability: Floats, job: Job) -> Proposal | None:
    """The best next experiment between fitted sets of causes; None where nothing is left to separate."""
    if len(rivals) < 2:
        return None
    before = _entropy(probability)
    best: Proposal | None = None
    for candidate in candidates(inquiry, job):
        try:
            extra = foresee(inquiry, rivals, candidate, job)
        except (CamcompError, ValueError):
            continue  # out of reach, or a force model that does not know the cut
        after = sum(
            p * _entropy(_posterior(inquiry, rivals, probability, extra, k)) for k, p in enumerate(probability) if p > 1e-3
        )
        gain = max(float(before - after), 0.0)
        if best is None or gain / candidate.minutes > best.gain / best.candidate.minutes:
            best = Proposal(candidate, gain, _names(inquiry, rivals))
    return best if best is not None and best.gain > _WORTH else None


def _names(inquiry: Inquiry, rivals: Sequence[Fitted]) -> tuple[str, ...]:
    sets = [set(f.members) for f in rivals]
    common = set.intersection(*sets)
    return tuple(dict.fromkeys(inquiry.columns.atoms[i].name for s in sets for i in sorted(s - common)))


def _entropy(p: Floats) -> float:
    p = p[p > 1e-12]
    return float(-(p * np.log2(p)).sum())


def _posterior(inquiry: Inquiry, rivals: Sequence[Fitted], probability: Floats, extra: Gram, truth: int) -> Floats:
    """Probabilities of the rivals once the candidate's logs are in, if `truth` is what the machine has."""
    logs = []
    for f, p in zip(rivals, probability, strict=True):
        index = inquiry.member_columns(rivals[truth].members)
        theta = np.zeros(extra.A.shape[0])
        theta[index] = rivals[truth].theta
        new = Gram(extra.A, extra.A @ theta, float(theta @ extra.A @ theta), extra.rows)
        known = total(f.grams)
        gain = Scale(known + new, inquiry.prior, inquiry.atoms)(f.members) - Scale(known, inquiry.prior, inquiry.atoms)(f.members)
        logs.append(np.log(max(p, 1e-12)) + gain)
    weight = np.exp(np.array(logs) - max(logs))
    return weight / weight.sum()


def foresee(inquiry: Inquiry, rivals: Sequence[Fitted], candidate: Candidate, job: Job) -> Gram:
    """White columns of the rivals' causes in the candidate's logs, the new run's own offset taken out."""
    run = _lay(inquiry, candidate, job)
    bench = Bench(inquiry.bench.twin, [run])
    k = len(inquiry.columns.names)
    c = bench.observed(0).shape[1]
    block = np.zeros((len(run.course.time), c, k + 3))
    for i in sorted({i for f in rivals for i in f.members}):
        atom = inquiry.columns.atoms[i]
        shape = next((f.extra[i] for f in rivals if i in f.extra), inquiry.shapes.get(i, shape_default(atom)))
        for column, per_run in zip(inquiry.atoms.columns[i], atom_columns(bench, atom, shape), strict=True):
            block[:, :, column] = per_run[0]
    for axis in range(3):
        block[:, axis, k + axis] = RUN_OFFSET_MM
    sigma = np.nanmean(inquiry.noise.sigma, axis=0)
    usual = np.concatenate([np.full(3, 0.002), np.full((c - 6) // 2, 0.0005), np.full((c - 6) // 2, 1.0), np.full(3, 2.0)])
    noise = replace(inquiry.noise, sigma=np.where(np.isfinite(sigma), sigma, usual)[None, :])
    inflate = np.where(np.isfinite(bench.observed(0)), 1.0, np.nan)
    white = noise.rows(0, block, inflate, run.course.time)
    A = white.T @ white
    own = A[k:, k:] + np.eye(3)
    A = A[:k, :k] - A[:k, k:] @ np.linalg.solve(own, A[k:, :k])
    return Gram(A, np.zeros(k), 0.0, len(white))


def _lay(inquiry: Inquiry, candidate: Candidate, job: Job) -> Run:
    twin = inquiry.bench.twin
    path = read_program(candidate.program.encode(), name="candidate").path
    timeline = schedule(path, job.config.control.acceleration_mm_per_s2)
    time = np.arange(0.0, timeline.end, _STEP_S)
    conditions = job.conditions if candidate.cutting else replace(job.conditions, model=None)
    warm = inquiry.bench.runs[0].course.temperature
    course = course_of_program(
        "candidate", timeline, lay_track(path, conditions), time, started=candidate.started, to_machine=twin.to_machine,
        vectors=job.frame.vectors, inverse=twin.inverse, temperature=None if warm is None else np.full(len(time), warm[-1]),
    )  # fmt: skip
    n, m = len(time), len(twin.actuators)
    width = {"tip": 3, "encoder": m, "drive": m, "dyno": 3}
    data: dict[str, Any] = {
        name: np.zeros((n, w)) if name in candidate.channels else np.full((n, w), np.nan) for name, w in width.items()
    }
    nan = np.full(n, np.nan)
    measured = Measured(time=time, line=nan, setpoint=np.full((n, m), np.nan), temperature=nan, **data)
    if measured.has("encoder"):
        measured = replace(measured, encoder=course.row_rho)
    return Run("candidate", course, measured, None, None)


def candidates(inquiry: Inquiry, job: Job) -> Iterator[Candidate]:
    """Feasible experiments about the place where the machine has worked so far, cheap ones first."""
    runs = inquiry.bench.runs
    tips = np.concatenate([inquiry.bench.nominal[k].tip for k in range(len(runs))])
    low, high = np.quantile(tips, 0.02, axis=0), np.quantile(tips, 0.98, axis=0)
    centre = 0.5 * (low + high)
    radius = float(np.clip(0.5 * np.min((high - low)[:2]), 5.0, 40.0))
    feed = _usual_feed(runs)
    end = max(run.course.started + float(run.course.time[-1]) for run in runs)
    have = tuple(c for c in _CHANNELS if any(run.measured.has(c) for run in runs))
    minutes = 2.0 * np.pi * radius / feed + _SETUP_MIN

    def circle(turn: int, at: Floats, f: float, plane: str = "G17") -> str:
        return circle_program(at, radius, f, turn, plane)

    soon = end + 60.0
    yield Candidate("circle, counter-clockwise", circle(1, centre, feed), True, have, soon, minutes)
    yield Candidate("circle in the reverse direction, clockwise", circle(-1, centre, feed), True, have, soon, minutes)
    yield Candidate("circle at four times the feed", circle(1, centre, 4 * feed), True, have, soon, minutes)
    yield Candidate("circle in the air, without cutting", circle(1, centre, feed), False, have, soon, minutes)
    yield Candidate("circle in the XZ plane, in the air", circle(1, centre, feed, "G18"), False, have, soon, minutes)
    for sign in (1.0, -1.0):
        there = centre + sign * np.array([60.0, 60.0, 0.0])
        where = "+60" if sign > 0 else "-60"
        yield Candidate(f"circle in the air at another place, X and Y {where} mm", circle(1, there, feed), False, have, soon, minutes)
    up = centre + np.array([0.0, 0.0, 60.0])
    yield Candidate("circle in the air 60 mm higher", circle(1, up, feed), False, have, soon, minutes)
    for axis, name in enumerate("XYZ"):
        yield Candidate(
            f"single-axis ladder along {name}, up and down, in the air", ladder_program(centre, radius, feed, axis), False, have,
            soon, 4.0 * radius / feed + _SETUP_MIN,
        )  # fmt: skip
    for channel in _CHANNELS[1:]:
        if channel not in have:
            yield Candidate(
                f"circle, counter-clockwise, and log {_NEEDS[channel]} as well", circle(1, centre, feed), True, (*have, channel),
                soon, minutes + _NEW_CHANNEL_MIN,
            )  # fmt: skip
    yield Candidate(
        "the same circle again after one hour of running", circle(1, centre, feed), True, have, end + 60.0 * _LATER_MIN,
        minutes + _LATER_MIN,
    )  # fmt: skip


def _usual_feed(runs: Sequence[Run]) -> float:
    feeds = [float(np.median(run.course.timeline.feed)) * 60.0 for run in runs if run.course.timeline is not None]
    return float(np.median(feeds)) if feeds else 1000.0


def circle_program(centre: Floats, radius: float, feed: float, turn: int, plane: str = "G17") -> str:
    """NC text of one full circle; turn +1 counter-clockwise, -1 clockwise, seen from the plane's positive axis."""
    x, y, z = (float(v) for v in centre)
    word = "G3" if turn > 0 else "G2"
    offset = f"I{-radius:.4f} J0" if plane == "G17" else f"I{-radius:.4f} K0"
    return (
        f"(experiment proposed by camcomp)\nG21 G90 {plane} G54\nG0 X{x + radius:.4f} Y{y:.4f} Z{z:.4f}\n"
        f"{word} X{x + radius:.4f} Y{y:.4f} Z{z:.4f} {offset} F{feed:.0f}\nM2\n"
    )


def ladder_program(centre: Floats, reach: float, feed: float, axis: int) -> str:
    """NC text of five steps up and five down along one axis."""
    letter = "XYZ"[axis]
    start = centre.copy()
    start[axis] -= reach
    x, y, z = (float(v) for v in start)
    stops = [start[axis] + 2.0 * reach * i / 5.0 for i in (1, 2, 3, 4, 5, 4, 3, 2, 1, 0)]
    moves = "".join(f"G1 {letter}{s:.4f} F{feed:.0f}\n" for s in stops)
    return f"(experiment proposed by camcomp)\nG21 G90 G17 G54\nG0 X{x:.4f} Y{y:.4f} Z{z:.4f}\n{moves}M2\n"
