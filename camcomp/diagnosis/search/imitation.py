"""How sure a cause is beside an unknown effect, which may do what the cause does.

What no library states may depend on one covariate, in any way: a family of generic patterns (position of one drive,
forces, moments in time ...), as large as all that is seen. The evidence of a set is the mean over these families, with
the set and without a member: a cause that one family does as well beside the rest of the unknown has none. What still
remains is no white noise, and evidence counts as much less as it varies more from one block of time to the next.
Source: model averaging (Hoeting et al., Statistical Science 14, 1999); composite likelihood with the sandwich's
information (Varin, Reid, Firth, Statistica Sinica 21, 2011).
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.special import expit, logsumexp

from camcomp.diagnosis.fit.columns import grounds
from camcomp.diagnosis.fit.intervals import BLOCKS
from camcomp.diagnosis.fit.problem import Problem
from camcomp.diagnosis.search.unknown import about
from camcomp.diagnosis.statistics.cause_sets import Fitted, Members
from camcomp.diagnosis.statistics.evidence import Gram, Prior, base, estimate, log_bayes
from camcomp.ground.datatypes import Floats, Ints

SIZES = (0.3, 1.0)  # of an unknown effect, in units of all that is seen
DEGREE = 4  # of the polynomials of the place: what depends on two axes at once


@dataclass(frozen=True, eq=False)
class _Rows:
    """All runs: white columns W (w, k), patterns D (w, p) by family, residual r (w,), block (w,) of time per way to count."""

    W: Floats
    r: Floats
    D: Floats
    families: tuple[Ints, ...]
    blocks: tuple[Ints, ...]


def credibility(problem: Problem, f: Fitted) -> dict[int, float]:
    """Probability of every member of f, where something unknown acts beside or instead of it."""
    if not f.members:
        return {}
    rows = _rows(problem, f)
    k = rows.W.shape[1]
    nothing = float(rows.r @ rows.r - len(rows.r))
    found: list[tuple[list[float], float, Floats, Ints]] = []
    sets = [f.members, *(tuple(j for j in f.members if j != i) for i in f.members)]
    for family, size in product(rows.families, SIZES):
        D = rows.D[:, family]
        energy = float(np.sum(D**2))
        if energy <= 0.0 or nothing <= 0.0:
            continue
        joint = np.concatenate([rows.W, D], axis=1)
        prior = _wider(problem.prior, len(family), size * np.sqrt(nothing / energy))
        data = Gram(joint.T @ joint, joint.T @ rows.r, float(rows.r @ rows.r), len(rows.r))
        at = base(data, prior, f.factor)
        evidence = [
            at.log_evidence + log_bayes(at, prior, [problem.candidates.columns[i] for i in each] if each else []) if each else at.log_evidence
            for each in sets
        ]
        mean, covariance = estimate(data, prior, problem.member_columns(f.members), f.factor)
        found.append((evidence, 0.0, mean, family))
        found[-1] = (evidence, 0.0, (joint @ covariance[:, problem.member_columns(f.members)], rows.r - joint @ mean, covariance), family)
    best = max(found, key=lambda each: each[0][0])
    value = np.array([each[0] for each in found])  # (families, sets)
    whole = logsumexp(value, axis=0)
    pull, rest, covariance = best[2]
    out, at = {}, 0
    for n, i in enumerate(f.members):
        mine = slice(at, at + len(problem.candidates.columns[i]))
        at = mine.stop
        index = problem.candidates.columns[i]
        strain = 1.0
        own = covariance[index, index]
        for block in rows.blocks:
            sums = np.zeros((block.max() + 1, len(index)))
            np.add.at(sums, block, pull[:, mine] * rest[:, None])
            strain = max(strain, float((np.sum(sums**2, axis=0) / own).max()))
        odds = (whole[0] - whole[n + 1]) / strain + problem.candidates.prior(f.members) - problem.candidates.prior(sets[n + 1])
        out[i] = float(expit(odds))
    return out


def _wider(prior: Prior, count: int, size: float) -> Prior:
    """The prior with `count` more columns of that size."""
    ones = np.ones(count)
    return Prior(
        np.concatenate([prior.tolerance, size * ones]),
        np.concatenate([prior.scale, ones]),
        np.concatenate([prior.sign, 0.0 * ones]),
        np.concatenate([prior.flexible, 0.0 * ones]),
    )


def _rows(problem: Problem, f: Fitted) -> _Rows:
    white, residual = about(problem, f)
    patterns, labels = [], []
    for k, parts in enumerate(problem.white_patterns):
        D, row, at = np.zeros((len(white[k]), sum(p.shape[1] for p in parts))), 0, 0
        for part in parts:
            D[row : row + len(part), at : at + part.shape[1]] = part
            row, at = row + len(part), at + part.shape[1]
        patterns.append(D)
    labels = [name for words in problem.dictionaries for name in words.labels]
    places = _places(problem)
    D = np.concatenate([np.concatenate(patterns), places], axis=1)
    names = np.array([*labels, *["place"] * places.shape[1]])
    of = np.array([name.split(":")[0] for name in names])
    whole = {"time", "temperature", "direction", "acceleration", "force", "velocity", "reversal", "place"}
    groups = [np.flatnonzero(names == name) for name in dict.fromkeys(names)]
    groups += [np.flatnonzero(of == name) for name in dict.fromkeys(of) if name in whole]
    blocks = []
    for count in BLOCKS:
        each = [
            np.minimum((problem.row_places(k) * count).astype(int), count - 1) + k * count
            for k in range(len(white))
        ]
        blocks.append(np.concatenate(each))
    return _Rows(np.concatenate(white), np.concatenate(residual), D, tuple(groups), tuple(blocks))


def _places(problem: Problem) -> Floats:
    """White polynomials (w, p) of the place in the workpiece, for each axis of the tip."""
    tips = [g.tip for g in grounds(problem.bench)]
    if not any(run.measured.has("tip") for run in problem.bench.runs):
        return np.zeros((sum(len(W) for W in problem.white), 0))
    everywhere = np.concatenate(tips)
    middle, half = 0.5 * (everywhere.max(axis=0) + everywhere.min(axis=0)), 0.5 * np.ptp(everywhere, axis=0)
    degrees = [d for d in product(range(DEGREE + 1), repeat=3) if 0 < sum(d) <= DEGREE and all(half[a] > 1e-3 or not d[a] for a in range(3))]
    out = []
    for k, tip in enumerate(tips):
        u = (tip - middle) / np.maximum(half, 1e-9)
        values = np.zeros((len(tip), 3, 3 * len(degrees)))
        for n, d in enumerate(degrees):
            one = np.prod([np.polynomial.legendre.legval(u[:, a], np.eye(DEGREE + 1)[d[a]]) for a in range(3)], axis=0)
            for a in range(3):
                values[:, a, 3 * n + a] = 1e-3 * one
        white = problem.noise.rows(k, values, problem.inflate[k], problem.times[k])
        full = np.zeros((len(problem.white[k]), values.shape[2]))
        full[: len(white)] = white
        out.append(full)
    return np.concatenate(out)
