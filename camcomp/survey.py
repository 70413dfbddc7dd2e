"""The search for causes on one inquiry: which sets are tried, in which order, and how they are ranked."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from camcomp.alike import Likeness, likeness, stand_ins
from camcomp.bench import thinned
from camcomp.datatypes import Floats
from camcomp.gap.colour import covariate
from camcomp.gap.evidence import Gram, estimate
from camcomp.gap.leftover import Leftover, Projected, project, score_test, unknown_evidence
from camcomp.gap.search import Fitted, Members, Scale, extensions, pairs, predictive, probabilities, total
from camcomp.gap.verdict import Verdict, judge
from camcomp.inquiry import Inquiry

SINGLES, PAIRS, TRIPLES = 6, 6, 3
TEMPERATURE = 1.5  # what evidence is divided by before it becomes a probability; calibrated on the truth plants
UNKNOWN_LOG10 = -10.0  # chance below which a leftover is no accident
UNKNOWN_RMS = 0.18  # size of a leftover, in units of the noise, below which no model error is called a cause
RUNS = 6  # runs that this holds for
UNKNOWN_SHARE = 0.12  # share of what is explained that a leftover has to exceed: no cause is modelled perfectly
NUISANCE_RMS = 0.25  # size of a cause, in units of the noise of the channel that shows it best, below which it is none
SLIGHT = 0.06  # of the largest member
ROUGHLY = 0.05  # share of an unknown effect's evidence that a known cause has to add beside it
MOSTLY = 0.3  # size of a leftover, in units of what the causes explain, below which the causes are not questioned
MINOR = 0.25  # size of a known cause, in units of an unknown one, below which it is not named beside it
UNKNOWN_COLOUR = 0.8  # size of what a sensor cannot have made, in units of what it can
WORSE = 2.0  # log density by which a cause has to harm the prediction of other runs before it goes
SAME_FIT = 4.0  # chi-square by which two sets may differ and still be the same answer


@dataclass(frozen=True, eq=False)
class Survey:
    """Sets of causes that were fitted, their probabilities, the verdict, and what the best of them leaves."""

    fits: tuple[Fitted, ...]
    probability: Floats
    verdict: Verdict
    left: Mapping[str, Leftover]  # per kind of channel
    strange: str | None  # the kind in which an effect shows that the library does not have


def survey(inquiry: Inquiry) -> Survey:
    """Tries no cause, single causes, pairs and triples; re-fits those that look best."""
    every = [i for i in range(len(inquiry.columns.atoms)) if visible(inquiry, i)]
    null = inquiry.refit(())
    at_null = Scale(total(null.grams), inquiry.prior, inquiry.atoms)
    done: dict[Members, Fitted] = {(): null}

    def fit(members: Members, near: Fitted | None = None) -> Fitted:
        if members not in done:
            theta = None
            if near is not None:
                index = inquiry.member_columns(members)
                theta = estimate(total(near.grams), inquiry.prior, index)[0][index]
            done[members] = inquiry.refit(members, theta)
        return done[members]

    def value(f: Fitted) -> float:
        return f.log_evidence + inquiry.atoms.prior(f.members)

    singles = extensions(at_null, (), every)
    for _, members in singles[:SINGLES]:
        fit(members)
    for members in _same_name(inquiry, singles[0][1], every):
        fit(members)
    ones = sorted((f for m, f in done.items() if len(m) == 1), key=value, reverse=True)
    found: list[tuple[float, Members, Fitted | None]] = [(v, m, None) for v, m in pairs(at_null, every, PAIRS)]
    for f in ones[:3]:
        scale = Scale(total(f.grams), inquiry.prior, inquiry.atoms)
        found += [(v, m, f) for v, m in extensions(scale, f.members, every)[:4]]
    best_one = max(value(f) for f in done.values())
    _fit_best(found, fit, PAIRS, best_one)
    twos = sorted((f for m, f in done.items() if len(m) == 2), key=value, reverse=True)
    found = []
    for f in twos[:2]:
        scale = Scale(total(f.grams), inquiry.prior, inquiry.atoms)
        found += [(v, m, f) for v, m in extensions(scale, f.members, every)[:3]]
    _fit_best(found, fit, TRIPLES, max(value(f) for f in done.values()))
    fits = tuple(sorted(done.values(), key=value, reverse=True))
    fits = tuple(f for f in fits if _matters(inquiry, f))
    probability = probabilities(fits, inquiry.atoms, TEMPERATURE)
    fits, probability = _prune(inquiry, fits, probability)
    design = likeness(inquiry)
    fits, probability, same = _with_stand_ins(inquiry, design, fits, probability, fit)
    verdict = judge(fits, probability, same)
    best = fits[verdict.best]
    left = leftovers(inquiry, best)
    # noise that is none stays whatever the causes are
    coloured = colour_left(inquiry, left)
    if coloured is not None or strangest(inquiry, best, left) is not None:
        members = best.members if coloured is None and _mostly(inquiry, best, left) else _known_part(inquiry, best)
        # beside something large and unknown, something small and known is most likely a part of it
        large = 1.0 if coloured is not None else max(each.rms for each in left.values())
        members = tuple(i for i in members if max(signal_rms(inquiry, best, (i,)).values()) > MINOR * large)
        if members != best.members:
            best = fit(members)
            fits = (best, *(f for f in fits if f is not best))
            probability = np.concatenate([[1.0], np.zeros(len(fits) - 1)])
            verdict = Verdict("identified", 0, (), dict.fromkeys(members, 1.0))
            left = leftovers(inquiry, best)
    if coloured is not None:
        return Survey(fits, probability, verdict, {**left, coloured.kind: coloured}, coloured.kind)
    return Survey(fits, probability, verdict, left, strangest(inquiry, best, left))


def _with_stand_ins(
    inquiry: Inquiry, design: Likeness, fits: tuple[Fitted, ...], probability: Floats, fit: Callable[[Members], Fitted]
) -> tuple[tuple[Fitted, ...], Floats, list[tuple[Members, Members]]]:
    """The fits with those sets added that do the same as the leader by their structure, and all pairs that are alike."""
    best = fits[int(np.argmax(probability))]
    same = _same(inquiry, fits, probability)
    for members in stand_ins(design, best.members, best.theta):
        other = fit(members)
        if not _plausible(inquiry, other):
            continue
        same.append((best.members, members))
        if all(f.members != members for f in fits):
            fits = (*fits, other)
    if len(fits) > len(probability):
        probability = probabilities(fits, inquiry.atoms, TEMPERATURE)
    return fits, probability, same


def colour_left(inquiry: Inquiry, left: Mapping[str, Leftover]) -> Leftover | None:
    """The noise of tip or encoders as a leftover, where it cannot be that of a sensor.

    left: what the patterns say of the leftover; a line in the spectrum is time's, of anything else they know more.
    """
    m = len(inquiry.bench.actuators)
    parts = {"tip": slice(0, 3), "encoder": slice(3, 3 + m)}
    found = {kind: inquiry.background.colour(part) for kind, part in parts.items()}
    kind = max(found, key=lambda each: found[each].ratio)
    if found[kind].ratio < UNKNOWN_COLOUR:
        return None
    rest = [r[:, parts[kind]] for r in inquiry.background.rest]
    drives = [np.where(np.isfinite(r), r, 0.0) for r in rest]
    if kind == "tip":
        for k, run in enumerate(inquiry.bench.runs):
            slope = thinned(inquiry.bench.row_slopes(k).reshape(-1, 3 * m), run.thin).reshape(-1, 3, m)
            drives[k] = np.einsum("nij,nj->ni", np.linalg.pinv(slope), drives[k])
    names = "xyz" if kind == "tip" else inquiry.bench.actuators
    label = covariate(rest, inquiry.times, drives, names, inquiry.bench.actuators, found[kind].excess)
    rows = sum(int(np.isfinite(r).sum()) for r in rest)
    known = left[kind].labels if kind in left and not label.startswith("time") else ()
    return Leftover(kind, -300.0, found[kind].ratio, rows, known or ((label, 1.0),))


def strangest(inquiry: Inquiry, f: Fitted, left: Mapping[str, Leftover]) -> str | None:
    """The kind of channel in which an effect shows that the library does not have, None where there is none."""
    explained = signal_rms(inquiry, f)
    # one run cannot show that something happens again
    least = UNKNOWN_RMS * np.sqrt(RUNS / min(len(inquiry.bench.runs), RUNS))
    found = {
        kind: each.energy
        for kind, each in left.items()
        if each.log10_chance < UNKNOWN_LOG10 and each.rms > max(least, UNKNOWN_SHARE * explained[kind])
    }
    return max(found, key=lambda kind: found[kind]) if found else None


def _mostly(inquiry: Inquiry, f: Fitted, left: Mapping[str, Leftover]) -> bool:
    """Whether a set explains so much of every kind of channel that what is left is a flaw of it, not something in its place."""
    explained = signal_rms(inquiry, f)
    return all(each.rms < MOSTLY * explained[kind] or each.rms < UNKNOWN_RMS for kind, each in left.items())


def _known_part(inquiry: Inquiry, best: Fitted) -> Members:
    """The members of the best set that are still causes when an unknown effect may take their place."""
    white, residual = about(inquiry, best)
    data = total(inquiry.grams(residual, white))
    scale = Scale(data, inquiry.prior, inquiry.atoms)
    found = []
    nothing = 0.0
    for count in range(len(best.members) + 1):
        for members in combinations(best.members, count):
            evidence = max(unknown_evidence(_projected(inquiry, white, residual, members)).values(), default=0.0)
            nothing = evidence if not members else nothing
            # Patterns follow an unknown effect only roughly; a cause is not kept for what they miss.
            value = evidence + scale(members) + inquiry.atoms.prior(members) - ROUGHLY * nothing * len(members)
            found.append((value, members))
    return max(found)[1]


def signal_rms(inquiry: Inquiry, f: Fitted, members: Members | None = None) -> dict[str, float]:
    """Size of what the members (or some of them) explain, per kind of channel, in units of the noise."""
    index = inquiry.member_columns(f.members)
    mine = set(inquiry.member_columns(f.members if members is None else members))
    theta = np.array([t if c in mine else 0.0 for c, t in zip(index, f.theta, strict=True)])
    out = {}
    for kind, words in enumerate(inquiry.dictionaries):
        energy = rows = 0.0
        for W, parts in zip(inquiry.white, inquiry.white_patterns, strict=True):
            first = sum(len(each) for each in parts[:kind])
            signal = W[first : first + len(parts[kind]), index] @ theta
            energy, rows = energy + float(signal @ signal), rows + len(signal)
        out[words.kind] = float(np.sqrt(energy / max(rows, 1.0)))
    return out


def visible(inquiry: Inquiry, i: int) -> bool:
    """Whether an effect of three scales would show at all in the channels present."""
    energy = sum(float((W[:, list(inquiry.atoms.columns[i])] ** 2).sum()) for W in inquiry.white)
    return energy * 9.0 > 1.0


def _matters(inquiry: Inquiry, f: Fitted) -> bool:
    """Whether every member shows in some kind of channel by more than what is always a little wrong.

    What lies below the noise beside something many times larger is most likely a fault in how that one is modelled.
    """
    sizes = [max(signal_rms(inquiry, f, (i,)).values(), default=0.0) for i in f.members]
    return all(each > (NUISANCE_RMS if each > SLIGHT * max(sizes) else 1.0) for each in sizes)


def _same_name(inquiry: Inquiry, members: Members, every: list[int]) -> list[Members]:
    """The leader's effect at its other targets: right effect, wrong actuator, is the mistake to exclude first."""
    names = {inquiry.columns.atoms[i].name for i in members}
    return [(i,) for i in every if inquiry.columns.atoms[i].name in names]


def _fit_best(found, fit, count: int, best: float) -> None:  # type: ignore[no-untyped-def]
    tried: set[Members] = set()
    for v, members, near in sorted(found, key=lambda each: -each[0]):
        if members in tried or v < best - 12.0 or len(tried) >= count:
            continue
        tried.add(members)
        fit(members, near)


def _prune(inquiry: Inquiry, fits: tuple[Fitted, ...], probability: Floats) -> tuple[tuple[Fitted, ...], Floats]:
    """Scores the leaders on runs not used for fitting; a set that predicts worse than the same set less a member goes."""
    if len(inquiry.bench.runs) < 2:
        return fits, probability
    keep = list(range(len(fits)))
    for j in list(np.argsort(-probability)[:4]):
        f = fits[j]
        if not f.members or probability[j] < 0.02:
            continue
        smaller = [tuple(x for x in f.members if x != i) for i in f.members]
        scores = predictive(f.grams, inquiry.prior, inquiry.atoms, [f.members, *smaller])
        if scores[0] < scores[1:].max() - WORSE:
            keep.remove(j)
    kept = tuple(fits[j] for j in keep)
    return kept, probability[keep] / probability[keep].sum()


def _same(inquiry: Inquiry, fits: tuple[Fitted, ...], probability: Floats) -> list[tuple[Members, Members]]:
    """Pairs of the leader and a set of its size that fits as well, whatever the priors say of them."""
    best = fits[int(np.argmax(probability))]
    found = []
    for f in fits:
        if f is best or len(f.members) != len(best.members) or not best.members:
            continue
        if misfit(inquiry, f) - misfit(inquiry, best) < SAME_FIT and _plausible(inquiry, f):
            found.append((best.members, f.members))
    return found


def misfit(inquiry: Inquiry, f: Fitted) -> float:
    """Chi-square left when the members are free and everything else stays within tolerance, penalties included."""
    data: Gram = total(f.grams)
    index = inquiry.member_columns(f.members)
    mean, _ = estimate(data, inquiry.prior, index, 1.0)
    return data.c - float(data.b @ mean)


def _plausible(inquiry: Inquiry, f: Fitted) -> bool:
    parameters = [p for i in f.members for p in inquiry.columns.atoms[i].parameters]
    return all(abs(t) < 8.0 and (p.sign == 0 or t > 0) for t, p in zip(f.theta, parameters, strict=True))


def _projected(inquiry: Inquiry, white: list[Floats], residual: list[Floats], members: Members) -> Projected:
    return project(
        white, inquiry.white_patterns, residual, [w.labels for w in inquiry.dictionaries],
        [w.kind for w in inquiry.dictionaries], inquiry.prior, inquiry.member_columns(members),
    )  # fmt: skip


def leftovers(inquiry: Inquiry, f: Fitted) -> dict[str, Leftover]:
    """Score test on what the set leaves, per kind of channel."""
    rows = {
        words.kind: sum(len(parts[k]) for parts in inquiry.white_patterns) for k, words in enumerate(inquiry.dictionaries)
    }
    return score_test(_projected(inquiry, *about(inquiry, f), f.members), rows)


def about(inquiry: Inquiry, f: Fitted) -> tuple[list[Floats], list[Floats]]:
    """White columns and residual (absolute coordinates) linearised at the fit."""
    if not f.members:
        return inquiry.white, inquiry.white_residual
    index = inquiry.member_columns(f.members)
    white = [W.copy() for W in inquiry.white]
    for W, own in zip(white, f.white, strict=True):
        W[:, index] = own
    return white, list(f.residual)
