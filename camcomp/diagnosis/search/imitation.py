"""How sure a cause is where something unknown may be: instead of it, or beside it.

What no library states may depend on one thing, in any way: a family of functions (of a place, of a drive's position, of
force, of time within each run ...), together as large as all that is seen. The probability of a cause is that of all
sets that have it, alone and with each family, over that of all sets: what one family does as well, no cause did surely.
What the best of them still leaves is no white noise, and evidence counts as much less as it varies more from one block
of time to the next. Sources: model averaging (Hoeting et al., Statistical Science 14, 1999); composite likelihood with
the sandwich's information (Varin, Reid, Firth, Statistica Sinica 21, 2011).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np
from scipy.special import expit, logsumexp

from camcomp.diagnosis.fit.floor import MINOR
from camcomp.diagnosis.fit.intervals import BLOCKS
from camcomp.diagnosis.fit.problem import Problem
from camcomp.diagnosis.search.families import Family, alone, families, kinds
from camcomp.diagnosis.search.unknown import about
from camcomp.diagnosis.statistics.by_channel import ByChannel
from camcomp.diagnosis.statistics.cause_sets import Fitted, Members, parts_of, total
from camcomp.diagnosis.statistics.evidence import Base, Gram, Prior, base, estimate, gram, holding_back, log_bayes
from camcomp.ground.datatypes import Floats, Ints

EITHER = 0.5  # one word against another
UNKNOWN = 0.1  # prior probability of something that the library does not have
DRAWN = 0.05  # probability of something unknown in a cause's place from which on it is held against what the cause does
LIKE = 0.1  # of a cause's signal, by which something unknown has to differ to be something else: no cause is modelled better
MOST_UNLIKE = 0.5  # the same where other causes do far more, which are modelled no better either


@dataclass(frozen=True, eq=False)
class Credibility:
    """Of every member of a set. present: its probability; replaced: that of something unknown in its place; drawn: share of
    the energy of what it does that the likeliest family beside the set could draw, 0 where no family is likelier than none.
    """

    present: Mapping[int, float]
    replaced: Mapping[int, float]
    drawn: Mapping[int, float]


def credibility(problem: Problem, f: Fitted, *, surely: bool, temperature: float) -> Credibility:
    """How sure the members of f are; surely: whether something unknown is there for certain."""
    if not f.members:
        return Credibility({}, {}, {})
    weight, index = _at_the_tip(problem), problem.member_columns(f.members)
    W, r = ByChannel.behind(about(problem, f)[0]).scaled(weight), weight * np.concatenate(f.residual)
    data = gram(W, r)
    sets, candidates = parts_of(f.members), problem.candidates
    hypotheses: list[tuple[Floats, float]] = []  # evidence per set, log prior
    best: tuple[float, Family | None] = (-np.inf, None)
    if not surely:
        hypotheses.append(
            (_evidence(problem, base(data, problem.prior, 1.0), problem.prior, sets), np.log(1.0 - UNKNOWN))
        )
        best = (hypotheses[0][0][0], None)
    values: list[Floats] = []
    for each in families(problem):  # one at a time: together they are as large as all else
        family = replace(each, columns=each.columns.scaled(weight[each.at]))
        beside = _beside(data, W, r, family)
        for part in family.parts:
            joint, prior = _joined(problem, data, beside, part)
            values.append(_evidence(problem, base(joint, prior, 1.0), prior, sets))
            if values[-1][0] > best[0]:
                best = float(values[-1][0]), family.alone(part)
    hypotheses += [(value, np.log(UNKNOWN / len(values))) for value in values]
    strain = _strain(problem=problem, data=data, W=W, r=r, family=best[1], index=index)
    log_prior = np.array([candidates.prior(each) for each in sets])
    present, replaced, at = dict[int, float](), dict[int, float](), 0
    stated = _at_stated_tolerances(problem, f, temperature)
    for i in f.members:
        mine = slice(at, at + len(candidates.columns[i]))
        at = mine.stop
        value = np.array([e / (temperature * strain[mine].max()) + log_prior + odds for e, odds in hypotheses])
        has = np.tile([float(i in each) for each in sets], (len(hypotheses), 1))
        whole, first = logsumexp(value), len(hypotheses) - len(values)
        without = np.max(np.where(has > 0.0, -np.inf, value), axis=1)[first:]
        likely = np.flatnonzero(without > whole + np.log(DRAWN))
        for n, each in enumerate(islice(alone(problem), int(likely.max(initial=-1)) + 1)):
            if n in likely:
                family = replace(each, columns=each.columns.scaled(weight[each.at]))
                drawn = max(
                    _draws(problem=problem, f=f, part=part, W=W, r=r, family=family)
                    for part in _parts(problem, f.members, i)
                )
                has[first + n] = np.maximum(has[first + n], drawn)
        unlike = np.exp(value - whole) * (1.0 - has)
        missed = float(unlike[first:].sum())
        # what rows do not need where nothing unknown is, nothing unknown replaces
        needless = float(np.exp(logsumexp(value[0][has[0] == 0.0]) - logsumexp(value[0]))) if first else 0.0
        # the search, whose evidence is not strained, has found the member: that rows need it is its word, that nothing unknown
        # was meant is the prior's
        found = (1.0 - UNKNOWN) * (unlike[:first].sum() + needless * missed)
        present[i] = min(float(np.sum(np.exp(value - whole) * has) + found), stated[i])
        replaced[i] = (1.0 - needless) * missed
    return Credibility(present, replaced, _drawn(problem, f, W, best[1]))


def _drawn(problem: Problem, f: Fitted, W: ByChannel, family: Family | None) -> dict[int, float]:
    """Share of the energy of what every member does that functions of a family could draw."""
    if family is None:
        return dict.fromkeys(f.members, 0.0)
    D, at, out = family.columns, problem.member_columns(f.members), dict[int, float]()
    own = D.T @ D
    for i in f.members:
        index = problem.member_columns((i,))
        signal = W[:, index] @ f.theta[[at.index(c) for c in index]]
        b = D.T @ signal[family.at]
        most = max(float(signal @ signal), 1e-300)
        out[i] = min(float(b @ np.linalg.lstsq(own, b, rcond=1e-9)[0]) / most, 1.0)
    return out


def _at_stated_tolerances(problem: Problem, f: Fitted, temperature: float) -> dict[int, float]:
    """Probability of every member of f beside the others where the tolerances are as stated, and not smaller because small errors do not show."""
    within, prior = base(total(f.grams), problem.prior, 1.0), problem.candidates.prior
    less = [tuple(x for x in f.members if x != i) for i in f.members]
    whole, *others = _evidence(problem, within, problem.prior, [f.members, *less])
    odds = [whole - e + prior(f.members) - prior(each) for e, each in zip(others, less, strict=True)]
    return {i: float(expit(x / temperature)) for i, x in zip(f.members, odds, strict=True)}


def _parts(problem: Problem, members: Members, i: int) -> list[Members]:
    """A member alone, and together with the others of its name: springs of several joints are one thing that gives way."""
    name = problem.columns.candidates[i].name
    mates = tuple(j for j in members if problem.columns.candidates[j].name == name)
    return [(i,), mates] if len(mates) > 1 else [(i,)]


def _draws(problem: Problem, f: Fitted, part: Members, W: ByChannel, r: Floats, family: Family) -> float:
    """How far the family, beside the other members, draws what a part of f does, 0 to 1: then it is that part by another name.

    Of all that may depend on velocity, a clock that is late makes one; of all that depends on force, a spring that is soft.
    It may differ by a share of what f does, as far as it still draws most of the part. Where it differs by more, but by what is
    minor at the tip, it is one word against another: nothing unknown is claimed for so little, and no law is shown either.
    """
    own, others = problem.member_columns(part), problem.member_columns(tuple(x for x in f.members if x not in part))
    at = problem.member_columns(f.members)
    signal, whole = W[:, own] @ f.theta[[at.index(c) for c in own]], W[:, at] @ f.theta
    joint, prior = _with(problem, gram(W, r), W, r, family)
    # what is wrong with others is of their own kind: it is no excuse where the family could not draw them
    D, seen = family.columns, whole[family.at]
    b = D.T @ seen
    whole_energy = float(b @ np.linalg.lstsq(D.T @ D, b, rcond=1e-9)[0])
    drawn = np.zeros(len(r))
    drawn[family.at] = family.columns @ estimate(joint, prior, others)[0][W.shape[1] :]
    apart = (drawn - signal) ** 2
    own_energy = float(np.sum(signal**2))
    if float(apart.sum()) < max(LIKE**2 * own_energy, min(LIKE**2 * whole_energy, MOST_UNLIKE**2 * own_energy)):
        return 1.0
    kind = kinds(problem)
    # rows of other channels are weighted by what is minor
    most = [MINOR if words.kind == "tip" else 1.0 for words in problem.dictionaries]
    minor = all(float(apart[kind == k].mean()) < size**2 for k, size in enumerate(most) if (kind == k).any())
    return EITHER if minor else 0.0


def _at_the_tip(problem: Problem) -> Floats:
    """Weight (w,) of every white row: no channel counts for more than what is not minor at the tip.

    An encoder tells a hundredth of it; there any formula is wrong, and any family better.
    """
    bench, m = problem.bench, len(problem.bench.actuators)
    springs = np.array([np.inf if a.stiffness is None else a.stiffness for a in bench.twin.robot.actuators])
    out = []
    for k, parts in enumerate(problem.white_patterns):
        way = np.sqrt(np.mean(np.sum(bench.row_slopes(k) ** 2, axis=1), axis=0))  # (m,) of the tip per way of a drive
        sigma = problem.noise.sigma[k]
        at_tip = {"encoder": sigma[3 : 3 + m] * way, "drive": sigma[3 + m : 3 + 2 * m] / springs * way}
        for words, part in zip(problem.dictionaries, parts, strict=True):
            seen = at_tip.get(words.kind, np.array([np.inf]))
            size = 1e3 * float(np.median(seen[np.isfinite(seen)])) if np.isfinite(seen).any() else np.inf
            out.append(np.full(len(part), min(1.0, size / (MINOR * problem.floor.tip_um))))
    return np.concatenate(out)


def _evidence(problem: Problem, at: Base, prior: Prior, sets: Sequence[Members]) -> Floats:
    columns = problem.candidates.columns
    return np.array([
        at.log_evidence + (float(log_bayes([at], prior, [columns[i] for i in each])[0]) if each else 0.0)
        - holding_back(at, prior, [c for i in each for c in columns[i]]) for each in sets
    ])  # fmt: skip


@dataclass(frozen=True, eq=False)
class _Beside:
    """A family beside all other columns: cross (k, p) and own (p, p) products, b (p,), energy of what its rows show beyond noise."""

    cross: Floats
    own: Floats
    b: Floats
    energy: float


def _beside(data: Gram, W: ByChannel, r: Floats, family: Family) -> _Beside:
    D, seen = family.columns, r[family.at]
    cross = (W if family.at.all() else W[np.flatnonzero(family.at)]).T @ D
    return _Beside(cross, D.T @ D, D.T @ seen, max(float(seen @ seen) - len(seen), 1.0))


def _joined(problem: Problem, data: Gram, beside: _Beside, part: Ints) -> tuple[Gram, Prior]:
    """Gram matrix and prior with some columns of a family behind all others, as large as all that its rows show."""
    cross, own = beside.cross[:, part], beside.own[np.ix_(part, part)]
    joint = Gram(
        np.block([[data.A, cross], [cross.T, own]]), np.concatenate([data.b, beside.b[part]]), data.c, data.rows
    )
    size = np.full(len(part), np.sqrt(beside.energy / float(np.trace(own))))
    prior, more = problem.prior, np.ones(len(part))
    return joint, Prior(
        np.concatenate([prior.tolerance, size]),
        np.concatenate([prior.scale, more]),
        np.concatenate([prior.sign, 0.0 * more]),
        np.concatenate([prior.flexible, 0.0 * more]),
        np.concatenate([prior.reach, np.inf * more]),
    )


def _with(problem: Problem, data: Gram, W: ByChannel, r: Floats, family: Family) -> tuple[Gram, Prior]:
    """The same with all columns of a family."""
    return _joined(problem, data, _beside(data, W, r, family), np.arange(family.columns.width))


def _strain(
    problem: Problem, data: Gram, W: ByChannel, r: Floats, family: Family | None, index: Sequence[int]
) -> Floats:
    """How much more than noise what is left varies from block to block of time, along each member's column (d,)."""
    prior = problem.prior
    if family is not None:
        data, prior = _with(problem, data, W, r, family)
    mean, covariance = estimate(data, prior, index)
    k, both = W.shape[1], np.column_stack([covariance[:, index], mean])
    does = W @ both[:k]
    if family is not None:
        does[family.at] += family.columns @ both[k:]
    pull = does[:, :-1] * (r - does[:, -1])[:, None]
    at = [problem.row_places(k) for k in range(len(problem.white))]
    worst = np.ones(len(index))
    for count in BLOCKS:
        block = np.concatenate([np.minimum((x * count).astype(int), count - 1) + k * count for k, x in enumerate(at)])
        sums = np.zeros((count * len(at), len(index)))
        np.add.at(sums, block, pull)
        worst = np.maximum(worst, np.sum(sums**2, axis=0) / np.diag(covariance)[index])
    return worst
