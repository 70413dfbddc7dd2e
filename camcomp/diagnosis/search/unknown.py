"""What a set of causes leaves: how much, what it depends on, and whether it is an effect that the library does not have."""

from collections.abc import Mapping
from dataclasses import replace
from itertools import combinations

import numpy as np

from camcomp.diagnosis.fit.bench import thinned
from camcomp.diagnosis.fit.gap import gap_of, gap_sizes, main_channels
from camcomp.diagnosis.fit.problem import Problem
from camcomp.diagnosis.statistics.cause_sets import Fitted, Members, total
from camcomp.diagnosis.statistics.evidence import Prior, base, estimate, log_bayes
from camcomp.diagnosis.statistics.score_test import (
    Projected,
    ResidualTest,
    project,
    score_test,
    unknown_evidence,
)
from camcomp.diagnosis.statistics.sensor_noise import covariate
from camcomp.ground.datatypes import Floats, Ints

UNKNOWN_LOG10 = -10.0  # chance below which a leftover is no accident
UNKNOWN_RMS = 0.18  # size of a leftover, in units of the noise, below which no model error is called a cause
RUNS = 6  # runs that this holds for
UNKNOWN_SHARE = 0.12  # share of what is explained that a leftover has to exceed: no cause is modelled perfectly
ROUGHLY = 0.05  # share of the evidence for an unknown effect that a known cause has to add beside it
MOSTLY = 0.3  # size of a leftover, in units of what the causes explain, below which the causes are not questioned
SURPRISE = 0.3  # size of what a set does not foretell of a run, in units of the noise, below which all is well
FEW = 4  # runs
CONFIRMED = 0.3  # share of what a run shows beyond noise that a cause beside an unknown one has to foretell of it
BELIED = 0.15  # share of it by which no run may get worse
FAINT_SHARE = (
    0.1  # what a run shows beyond noise, in units of the noise's energy, below which there is nothing to foretell
)
STRAINED = 2.5  # offsets of runs, in units of what repeats, above which they are no repeatability
UNKNOWN_COLOUR = 0.8  # size of what a sensor cannot have made, in units of what it can


def residual_tests(problem: Problem, f: Fitted, prior: Prior) -> dict[str, ResidualTest]:
    """Score test on what the set leaves, per kind of channel; prior: of everything beside the set."""
    rows = {
        words.kind: sum(len(parts[k]) for parts in problem.white_patterns)
        for k, words in enumerate(problem.dictionaries)
    }
    return score_test(_projected(problem, prior, *about(problem, f), f.members), rows)


def about(problem: Problem, f: Fitted) -> tuple[list[Floats], list[Floats]]:
    """White columns and residual (absolute coordinates) linearised at the fit."""
    if not f.members:
        return problem.white, problem.white_residual
    index = problem.member_columns(f.members)
    white = [W.copy() for W in problem.white]
    for W, own in zip(white, f.white, strict=True):
        W[:, index] = own
    return white, list(f.residual)


def steady_prior(problem: Problem, f: Fitted) -> Prior:
    """The prior that a set's leftover is judged with: runs repeat as well as they do, and what would need more is no accident.

    Offsets of runs that are within reason stay free within it. Where they are not, or where the set does not foretell a
    run from the others, they would hide what differs from run to run, and are held at nought.
    """
    offsets = problem.columns.run_offsets
    size = _strain(problem, f)[offsets]
    if len(size) and (np.sqrt(np.mean(size**2)) > STRAINED or _surprised(problem, f)):
        return _held(problem.prior, offsets)
    return problem.prior


def _surprised(problem: Problem, f: Fitted) -> bool:
    """Whether tips go where a set fitted to the other runs does not let one expect; with few runs no fit is that sure."""
    if len(problem.bench.runs) < FEW:
        return False
    least = max(SURPRISE, UNKNOWN_SHARE * signal_rms(problem, f).get("tip", 0.0))
    left = _unforetold(problem, f, f.members)
    return "tip" in left and float(np.mean(left["tip"])) > least**2


def firm_prior(problem: Problem) -> Prior:
    """The prior to describe an unknown effect with: everything else is as stated, and no tolerance stretches to follow it."""
    return _held(problem.prior, np.flatnonzero(np.isfinite(problem.prior.tolerance)))


def _strain(problem: Problem, f: Fitted) -> Floats:
    """Every column (k,) beside a set in units of its tolerance; 0 where it is free."""
    index = problem.member_columns(f.members)
    out = estimate(total(f.grams), problem.prior, index, 1.0)[0] / problem.prior.tolerance
    out[index] = 0.0
    return out


def _held(prior: Prior, columns: Ints) -> Prior:
    tolerance = prior.tolerance.copy()
    tolerance[columns] *= 1e-3
    return replace(prior, tolerance=tolerance)


def _projected(
    problem: Problem, prior: Prior, white: list[Floats], residual: list[Floats], members: Members
) -> Projected:
    return project(
        white, problem.white_patterns, residual, [w.labels for w in problem.dictionaries],
        [w.kind for w in problem.dictionaries], prior, problem.member_columns(members),
    )  # fmt: skip


def signal_rms(problem: Problem, f: Fitted, members: Members | None = None) -> dict[str, float]:
    """Size of what the members (or some of them) explain, per kind of channel, in units of the noise."""
    index = problem.member_columns(f.members)
    mine = set(problem.member_columns(f.members if members is None else members))
    theta = np.array([t if c in mine else 0.0 for c, t in zip(index, f.theta, strict=True)])
    out = {}
    for kind, words in enumerate(problem.dictionaries):
        energy = rows = 0.0
        for W, parts in zip(problem.white, problem.white_patterns, strict=True):
            first = sum(len(each) for each in parts[:kind])
            signal = W[first : first + len(parts[kind]), index] @ theta
            energy, rows = energy + float(signal @ signal), rows + len(signal)
        out[words.kind] = float(np.sqrt(energy / max(rows, 1.0)))
    return out


def strongest_unknown(problem: Problem, f: Fitted, left: Mapping[str, ResidualTest]) -> str | None:
    """The kind of channel in which an effect shows that the library does not have, None where there is none."""
    explained = signal_rms(problem, f)
    # one run cannot show that something happens again
    least = UNKNOWN_RMS * np.sqrt(RUNS / min(len(problem.bench.runs), RUNS))
    found = {
        kind: each.energy
        for kind, each in left.items()
        if each.log10_chance < UNKNOWN_LOG10 and each.rms > max(least, UNKNOWN_SHARE * explained[kind])
    }
    return max(found, key=lambda kind: found[kind]) if found else None


def colour_left(problem: Problem, left: Mapping[str, ResidualTest]) -> ResidualTest | None:
    """The noise of tip or encoders as a leftover, where it cannot be that of a sensor.

    left: what the patterns say of the leftover; a line in the spectrum is time's, of anything else they know more.
    """
    m = len(problem.bench.actuators)
    parts = {"tip": slice(0, 3), "encoder": slice(3, 3 + m)}
    found = {kind: problem.background.colour(part) for kind, part in parts.items()}
    kind = max(found, key=lambda each: found[each].ratio)
    if found[kind].ratio < UNKNOWN_COLOUR:
        return None
    rest = [r[:, parts[kind]] for r in problem.background.rest]
    drives = [np.where(np.isfinite(r), r, 0.0) for r in rest]
    if kind == "tip":
        for k, run in enumerate(problem.bench.runs):
            slope = thinned(problem.bench.row_slopes(k).reshape(-1, 3 * m), run.thin).reshape(-1, 3, m)
            drives[k] = np.einsum("nij,nj->ni", np.linalg.pinv(slope), drives[k])
    names = "xyz" if kind == "tip" else problem.bench.actuators
    label = covariate(rest, problem.times, drives, names, problem.bench.actuators, found[kind].excess)
    rows = sum(int(np.isfinite(r).sum()) for r in rest)
    known = left[kind].labels if kind in left and not label.startswith("time") else ()
    return ResidualTest(kind, -300.0, found[kind].ratio, rows, known or ((label, 1.0),))


def mostly(problem: Problem, f: Fitted, left: Mapping[str, ResidualTest]) -> bool:
    """Whether a set explains so much of every kind of channel that what is left is a flaw of it, not something in its place."""
    if steady_prior(problem, f) is not problem.prior:
        return False  # a cause that some runs do not show
    explained = signal_rms(problem, f)
    return all(each.rms < MOSTLY * explained[kind] or each.rms < UNKNOWN_RMS for kind, each in left.items())


def idle(problem: Problem, f: Fitted, most: float = 0.0) -> bool:
    """Whether a set's causes, put into the machine by themselves, leave the tip where it was.

    A fit has help from all that is always a little wrong; causes that take more from there than they give explain
    nothing. most: share of the gap's energy beyond noise that they have to take away.
    """
    stated = gap_of(problem)
    noise = stated["noise_floor_um"] ** 2
    whole = stated["rms_um"] ** 2 - noise
    if main_channels(problem).start != 0 or not f.members or whole < noise:
        return False
    left = float(np.mean(gap_sizes(problem, problem.causes(f.members, f.theta, f.extra)) ** 2)) - noise
    return left > (1.0 - most) * whole


def known_part(problem: Problem, best: Fitted) -> Members:
    """The members of the best set that are still causes when an unknown effect may take their place."""
    white, residual = about(problem, best)
    prior = steady_prior(problem, best)
    alone = base(total(problem.grams(residual, white)), prior, 1.0)
    found = []
    nothing = 0.0
    for count in range(len(best.members) + 1):
        for members in combinations(best.members, count):
            evidence = max(unknown_evidence(_projected(problem, prior, white, residual, members)).values(), default=0.0)
            nothing = evidence if not members else nothing
            sets = [problem.candidates.columns[i] for i in members]
            known = log_bayes(alone, prior, sets) if sets else 0.0
            # Patterns follow an unknown effect only roughly; a cause is not kept for what they miss, unless it leaves nothing.
            rough = ROUGHLY * nothing * len(members) if evidence > ROUGHLY * nothing else 0.0
            found.append((evidence + known + problem.candidates.prior(members) - rough, members))
    return max(found)[1]


def confirmed(problem: Problem, f: Fitted) -> Members:
    """The members that foretell, fitted to the other runs, what a run shows: all that counts beside an unknown effect.

    In the runs that they were fitted to, any few effects follow an unknown one for some way.
    """
    members = f.members
    while members and len(problem.bench.runs) > 1:
        now = _unforetold(problem, f, members)
        gains = [_gain(_unforetold(problem, f, tuple(each for each in members if each != i)), now) for i in members]
        if min(gains) >= CONFIRMED:
            break
        least = members[int(np.argmin(gains))]
        members = tuple(each for each in members if each != least)
    return members


def _gain(before: Mapping[str, Floats], after: Mapping[str, Floats]) -> float:
    """Share of the energy that a member foretells in the kind of channel that it foretells best; 0 if a run belies it."""
    gains = [0.0]
    for kind, each in before.items():
        whole = max(float(np.mean(each)), FAINT_SHARE)
        change = each - after[kind]
        if min(change) > -BELIED * whole:
            gains.append(float(np.mean(change)) / whole)
    return max(gains)


def _unforetold(problem: Problem, f: Fitted, members: Members) -> dict[str, Floats]:
    """Energy per row (runs,) that members of a set leave of runs that they were not fitted to, per kind of channel.

    Beyond noise, beyond what runs differ by anyway, and beyond what the doubt about the members' amplitudes makes.
    """
    index, offsets = problem.member_columns(members), problem.columns.run_offsets
    free = np.flatnonzero(np.isinf(problem.prior.tolerance))
    whole = total(f.grams)
    out: dict[str, list[float]] = {words.kind: [] for words in problem.dictionaries}
    for g, W, r, parts in zip(f.grams, *about(problem, f), problem.white_patterns, strict=True):
        mean, covariance = estimate(whole - g, problem.prior, index)
        rest = r - W[:, index] @ mean[index]
        if len(free):  # frames and clocks that are a run's own
            rest = rest - W[:, free] @ np.linalg.lstsq(W[:, free], rest, rcond=None)[0]
        doubt = np.sum((W[:, index] @ covariance[np.ix_(index, index)]) * W[:, index], axis=1)
        doubt += np.sum((W[:, offsets] * problem.prior.tolerance[offsets]) ** 2, axis=1)
        energy = rest**2 - doubt - 1.0
        at = 0
        for kind, part in zip(out, parts, strict=True):
            out[kind].append(float(np.mean(energy[at : at + len(part)])) if len(part) else 0.0)
            at += len(part)
    return {kind: np.array(each) for kind, each in out.items()}
