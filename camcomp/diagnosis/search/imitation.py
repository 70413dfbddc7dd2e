"""How sure a cause is where something unknown may be: instead of it, or beside it.

What no library states may depend on one thing, in any way: a family of functions (of a place, of a drive's position, of
force, of time within each run ...), together as large as all that is seen. The probability of a cause is that of all
sets that have it, alone and with each family, over that of all sets: what one family does as well, no cause did surely.
What the best of them still leaves is no white noise, and evidence counts as much less as it varies more from one block
of time to the next. Sources: model averaging (Hoeting et al., Statistical Science 14, 1999); composite likelihood with
the sandwich's information (Varin, Reid, Firth, Statistica Sinica 21, 2011).
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, product

import numpy as np
from scipy.special import logsumexp

from camcomp.diagnosis.fit.columns import grounds
from camcomp.diagnosis.fit.floor import MINOR
from camcomp.diagnosis.fit.intervals import BLOCKS
from camcomp.diagnosis.fit.patterns import Ground
from camcomp.diagnosis.fit.problem import Problem
from camcomp.diagnosis.search.unknown import about
from camcomp.diagnosis.statistics.by_channel import ByChannel
from camcomp.diagnosis.statistics.cause_sets import Fitted, Members
from camcomp.diagnosis.statistics.evidence import Base, Gram, Prior, base, estimate, gram, holding_back, log_bayes
from camcomp.ground.datatypes import Bools, Floats, Ints

UNKNOWN = 0.1  # prior probability of something that the library does not have
WAVES = 24  # half waves along a travel: a bump of a twentieth of it is still followed
MOVES_MM, MOVES_DRIVE = 1e-3, 1e-6  # of an axis, of a drive (mm or rad), on which something can depend
SAME = 1.0 - 1e-9  # correlation of two places that are one
DEGREE = 4  # of the polynomials of what depends on several axes at once
IN_A_RUN = 8  # degree of those of time, for every run anew
ALL_SETS = 3  # members up to which every subset is looked at; of larger ones each alone, and all but one
DRAWN = 0.05  # probability of something unknown in a cause's place from which on it is held against what the cause does
LIKE = (
    0.1  # of a cause's signal, by which something unknown has to differ to be something else: none is modelled better
)
MOST_UNLIKE = 0.5  # the same where other causes do far more, which are modelled no better either
OF_WHAT_MOVES = ("velocity", "reversal", "force", "acceleration", "direction", "temperature")


@dataclass(frozen=True, eq=False)
class _Family:
    """Functions of one thing: name, which of all white rows (w,) they touch, their white columns there (rows, p)."""

    name: str
    at: Bools
    columns: ByChannel


def credibility(
    problem: Problem, f: Fitted, *, surely: bool, temperature: float
) -> tuple[dict[int, float], dict[int, float]]:
    """Probability of every member of f, and of something unknown in its place; surely: whether that is there for certain."""
    if not f.members:
        return {}, {}
    weight, index = _at_the_tip(problem), problem.member_columns(f.members)
    W, r = ByChannel.behind(about(problem, f)[0]).scaled(weight), weight * np.concatenate(f.residual)
    data = gram(W, r)
    sets, candidates = _subsets(f.members), problem.candidates
    hypotheses: list[tuple[Floats, float]] = []  # evidence per set, log prior
    best: tuple[float, _Family | None] = (-np.inf, None)
    if not surely:
        hypotheses.append(
            (_evidence(problem, base(data, problem.prior, 1.0), problem.prior, sets), np.log(1.0 - UNKNOWN))
        )
        best = (hypotheses[0][0][0], None)
    values: list[Floats] = []
    for each in _families(problem):  # one at a time: together they are as large as all else
        family = replace(each, columns=each.columns.scaled(weight[each.at]))
        joint, prior = _with(problem, data, W, r, family)
        values.append(_evidence(problem, base(joint, prior, 1.0), prior, sets))
        best = max(best, (float(values[-1][0]), family), key=lambda each: each[0])
    hypotheses += [(value, np.log(UNKNOWN / len(values))) for value in values]
    strain = _strain(problem, data, W, r, best[1], index)
    log_prior = np.array([candidates.prior(each) for each in sets])
    present, replaced, at = dict[int, float](), dict[int, float](), 0
    for i in f.members:
        mine = slice(at, at + len(candidates.columns[i]))
        at = mine.stop
        value = np.array([e / (temperature * strain[mine].max()) + log_prior + odds for e, odds in hypotheses])
        has = np.tile([i in each for each in sets], (len(hypotheses), 1))
        whole, first = logsumexp(value), len(hypotheses) - len(values)
        likely = first + np.flatnonzero(np.max(np.where(has, -np.inf, value), axis=1)[first:] > whole + np.log(DRAWN))
        for n, each in enumerate(_families(problem), first):
            if n in likely:
                family = replace(each, columns=each.columns.scaled(weight[each.at]))
                has[n] |= any(_draws(problem, f, part, W, r, family) for part in _parts(problem, f.members, i))
        unlike = np.exp(value - whole) * ~has
        # the search, whose evidence is not strained, has found the member: where nothing unknown takes its place, one word against another
        present[i] = float(np.sum(np.exp(value - whole) * has) + 0.5 * unlike[:first].sum())
        replaced[i] = float(unlike[first:].sum())
    return present, replaced


def _parts(problem: Problem, members: Members, i: int) -> list[Members]:
    """A member alone, and together with the others of its name: springs of several joints are one thing that gives way."""
    name = problem.columns.candidates[i].name
    mates = tuple(j for j in members if problem.columns.candidates[j].name == name)
    return [(i,), mates] if len(mates) > 1 else [(i,)]


def _draws(problem: Problem, f: Fitted, part: Members, W: ByChannel, r: Floats, family: _Family) -> bool:
    """Whether the family, beside the other members, draws what a part of f does: then it is that part by another name.

    Of all that may depend on velocity, a clock that is late makes one; of all that depends on force, a spring that is soft.
    It may differ by a share of what f does, as far as it still draws most of the part, or by what is minor at the tip:
    nothing unknown is claimed for less.
    """
    own, others = problem.member_columns(part), problem.member_columns(tuple(x for x in f.members if x not in part))
    at = problem.member_columns(f.members)
    signal, whole = W[:, own] @ f.theta[[at.index(c) for c in own]], W[:, at] @ f.theta
    joint, prior = _with(problem, gram(W, r), W, r, family)
    drawn = np.zeros(len(r))
    drawn[family.at] = family.columns @ estimate(joint, prior, others)[0][W.shape[1] :]
    apart = (drawn - signal) ** 2
    own_energy = float(np.sum(signal**2))
    if float(apart.sum()) < max(
        LIKE**2 * own_energy, min(LIKE**2 * float(np.sum(whole**2)), MOST_UNLIKE**2 * own_energy)
    ):
        return True
    kinds = _kinds(problem)
    # rows of other channels are weighted by what is minor
    most = [MINOR if words.kind == "tip" else 1.0 for words in problem.dictionaries]
    return all(float(apart[kinds == k].mean()) < size**2 for k, size in enumerate(most) if (kinds == k).any())


def _kinds(problem: Problem) -> Ints:
    """Index of the kind of channel of every white row (w,)."""
    return np.concatenate([np.repeat(np.arange(len(p)), [len(part) for part in p]) for p in problem.white_patterns])


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


def _subsets(members: Members) -> list[Members]:
    """The set itself, and sets of some of its members."""
    n = len(members)
    sizes = range(n - 1, -1, -1) if n <= ALL_SETS else (n - 1, 1, 0)
    return [members, *(each for size in sizes for each in combinations(members, size))]


def _evidence(problem: Problem, at: Base, prior: Prior, sets: Sequence[Members]) -> Floats:
    columns = problem.candidates.columns
    return np.array([
        at.log_evidence + (float(log_bayes([at], prior, [columns[i] for i in each])[0]) if each else 0.0)
        - holding_back(at, prior, [c for i in each for c in columns[i]]) for each in sets
    ])  # fmt: skip


def _with(problem: Problem, data: Gram, W: ByChannel, r: Floats, family: _Family) -> tuple[Gram, Prior]:
    """Gram matrix and prior with the columns of a family behind all others, as large as all that its rows show."""
    D, seen = family.columns, r[family.at]
    cross = (W if family.at.all() else W[np.flatnonzero(family.at)]).T @ D
    own = D.T @ D
    joint = Gram(np.block([[data.A, cross], [cross.T, own]]), np.concatenate([data.b, D.T @ seen]), data.c, data.rows)
    energy = max(float(seen @ seen) - len(seen), 1.0)
    size = np.full(D.width, np.sqrt(energy / float(np.trace(own))))
    prior, more = problem.prior, np.ones(D.width)
    return joint, Prior(
        np.concatenate([prior.tolerance, size]),
        np.concatenate([prior.scale, more]),
        np.concatenate([prior.sign, 0.0 * more]),
        np.concatenate([prior.flexible, 0.0 * more]),
        np.concatenate([prior.reach, np.inf * more]),
    )


def _strain(
    problem: Problem, data: Gram, W: ByChannel, r: Floats, family: _Family | None, index: Sequence[int]
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


def _families(problem: Problem) -> Iterator[_Family]:
    """Of all that something unknown may depend on."""
    everywhere = _kinds(problem)
    kinds_of = [words.kind for words in problem.dictionaries]
    names = [name for words in problem.dictionaries for name in words.labels]
    whole = np.array([name.split(":")[0] for name in names])
    # the first of an axis' functions of time is one throughout: an unknown effect has some mean
    constant = [words.kind == "tip" and name.startswith("time:") and name not in words.labels[:n]
                for words in problem.dictionaries for n, name in enumerate(words.labels)]  # fmt: skip
    of = np.repeat(np.arange(len(problem.dictionaries)), [len(words.labels) for words in problem.dictionaries])
    for word in OF_WHAT_MOVES:
        picked = np.flatnonzero(whole == word)
        if len(picked):
            picked = np.concatenate([picked, np.flatnonzero(constant)])
            yield _Family(word, np.ones(len(everywhere), bool), _patterns(problem, picked, of))
    if "tip" not in kinds_of:
        return
    at = everywhere == kinds_of.index("tip")
    for name, values in _of_place(grounds(problem.bench)):
        yield _Family(name, at, _white_tip(problem, values))


def _patterns(problem: Problem, picked: Ints, of: Ints) -> ByChannel:
    """White columns (w, p) of some of the patterns of all kinds of channels."""
    out: list[tuple[Ints, Floats]] = []
    for parts in problem.white_patterns:
        for kind, part in enumerate(parts):
            mine = np.flatnonzero(of[picked] == kind)
            out += part.placed(picked[mine] - int(np.searchsorted(of, kind)), mine, len(picked)).parts
    return ByChannel(len(picked), tuple(out))


def _of_place(every: Sequence[Ground]) -> Iterator[tuple[str, list[Floats]]]:
    """Names, and functions (n, p) per run, of places, of positions, of several axes at once, and of time in each run."""
    tips, drives = [g.tip for g in every], [g.motion.encoder for g in every]
    places = [np.concatenate([tip, drive], axis=1) for tip, drive in zip(tips, drives, strict=True)]
    low = np.min([p.min(axis=0) for p in places], axis=0)
    span = np.max([p.max(axis=0) for p in places], axis=0) - low
    u = [(p - low) / np.maximum(span, 1e-9) for p in places]
    least, seen = np.repeat([MOVES_MM, MOVES_DRIVE], [3, len(span) - 3]), np.concatenate(u)
    moving = np.flatnonzero(span > least)
    k = np.arange(WAVES + 1)
    for n, a in enumerate(moving):
        if any(abs(np.corrcoef(seen[:, a], seen[:, b])[0, 1]) > SAME for b in moving[:n]):
            continue  # of a machine of slides: the axis is the drive's
        yield f"position {a}", [np.cos(np.pi * k * x[:, a, None]) / np.maximum(k, 1) for x in u]
    axes = [a for a in moving if a < 3]
    powers = [d for d in product(range(DEGREE + 1), repeat=len(axes)) if sum(d) <= DEGREE]
    leg = np.polynomial.legendre.legvander
    if axes:
        high = [leg(2.0 * x[:, axes] - 1.0, DEGREE) for x in u]  # (n, axes, degrees)
        yield (
            "place",
            [np.stack([np.prod([h[:, n, e] for n, e in enumerate(d)], axis=0) for d in powers], 1) for h in high],
        )
    runs = range(len(every))
    yield "time", [np.kron(np.eye(len(every))[r], leg(np.linspace(-1, 1, len(every[r].tip)), IN_A_RUN)) for r in runs]


def _white_tip(problem: Problem, values: Sequence[Floats]) -> ByChannel:
    """White rows of the tip (rows, 3 p) of functions (n, p) per run, each on each axis, in um."""
    out = []
    for k, one in enumerate(values):
        p = one.shape[1]
        axes = ByChannel(3 * p, tuple((axis * p + np.arange(p), 1e-3 * one) for axis in range(3)))
        out.append(problem.noise.by_channel(k, axes, problem.inflate[k], problem.times[k]))
    return ByChannel.behind(out)
