"""The law in the answer of a diagnosis: what is left of the gap with it, on parts that it was not fitted to."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from camcomp.diagnosis.fit.cause_sets import Fitted, parts_of, temperature_of
from camcomp.diagnosis.fit.gap import main_channels
from camcomp.diagnosis.fit.problem import Problem
from camcomp.diagnosis.law.bench_terms import TermBench, spots
from camcomp.diagnosis.law.describe import law_result, moved_without
from camcomp.diagnosis.law.find import BETTER, FoundLaw, find_law
from camcomp.diagnosis.law.screen import term_grids
from camcomp.diagnosis.model.evidence import Members
from camcomp.diagnosis.model.folds import ABOVE
from camcomp.diagnosis.result.types import Law
from camcomp.diagnosis.search.unknown import firm_prior
from camcomp.diagnosis.statistics.by_channel import ByChannel
from camcomp.diagnosis.statistics.evidence import FREE, Prior
from camcomp.diagnosis.statistics.folds import Folds, Split
from camcomp.ground.datatypes import Floats


@dataclass(frozen=True, eq=False, kw_only=True)
class LawAnswer:
    """law: as in the result; before: gaps (n, 3) mm of the tip per run that the causes alone leave; gaps: what they leave as they
    stand beside the law; signal: what it does to the tip (n, 3) mm per run; all fitted without what they are judged on; found: its
    terms; problem: with the law in it; fit: the causes that stand there, fitted together with it.
    """

    law: Law
    before: list[Floats]
    gaps: list[Floats]
    signal: list[Floats]
    found: FoundLaw
    problem: Problem
    fit: Fitted


def term_bench(problem: Problem) -> TermBench:
    """Where terms are evaluated for a problem."""
    return TermBench(problem.bench, problem.noise)


def answer_law(problem: Problem, f: Fitted, kind: str) -> LawAnswer | None:
    """The law or map that an unknown effect follows in a kind of channel; None where all fail on withheld parts.

    A large residual of the law with the causes suggests that causes and tolerances follow the unknown effect: then a
    law is sought without them. If that residual is large too, a map is sought. All causes are judged again jointly with
    the result.
    """
    if main_channels(problem).start != 0 or kind not in ("tip", "encoder"):
        return None
    bench = term_bench(problem)
    floor, before = problem.floor.tip_um, rms_um(_gaps(problem, f))
    room = float(np.sqrt(max(before**2 - floor**2, 0.0)))

    def find(own: Fitted | None, smooth: bool) -> FoundLaw | None:
        return find_law(bench, _base(problem, own, bench, kind), term_grids(bench, kind, smooth=smooth), 1e-3 * floor)

    best: tuple[FoundLaw, Fitted | None] | None = None
    after = before
    # what is small without the causes may be the usual small errors
    for k, (own, smooth, asked) in enumerate(((f, False, True), (None, False, room > floor), (f, True, kind == "tip"))):
        much = after**2 - floor**2 > (ABOVE - 1.0) * max(floor, room) ** 2
        if k and not (asked and much):
            continue
        tried = find(own, smooth)
        left = np.inf if tried is None else rms_um(*_beside(problem, own, bench, tried))
        if tried is not None and left < BETTER * after:
            best, after = (tried, own), left
    if best is None:
        return None
    found, own = best
    joint = with_law(problem, found)
    fit = fit_needed(joint, f.members)
    if own is not None or fit.members:  # about the values that the causes have beside it
        own, found = fit, replace(found, folds=_base(problem, fit, bench, kind)(found.folds.split, False))
    gaps, signal = _beside(problem, own, bench, found)
    without = _gaps(problem, f if fit.members == f.members else problem.refit(fit.members))
    law = law_result(bench, found, rms_um(without), rms_um(gaps, signal))
    return LawAnswer(law=law, before=without, gaps=gaps, signal=signal, found=found, problem=joint, fit=fit)


def _base(problem: Problem, f: Fitted | None, bench: TermBench, kind: str) -> Callable[[Split, bool], Folds]:
    """Base of a law search: the causes of f and all coordinates with a tolerance, or the firm prior alone where f is
    None.

    On request it has a free constant at every spot of the tip.
    """
    if f is None:
        white, residual, precision = problem.white, problem.white_residual, firm_prior(problem).precision
    else:
        white, residual = problem.white_at(f), list(f.residual)
        precision, members = problem.prior.precision, problem.member_columns(f.members)
        precision[members] = FREE
    places = [problem.row_places(k) for k in range(len(residual))]
    tips = [s for s in spots(len(problem.bench.actuators), kind) if s.on != "drive"]
    ones = [bench.white(s, [np.ones((r.rows, 1)) for r in bench.rows(s)]) for s in tips]
    return lambda split, free: Folds(
        white=white, residual=residual, precision=precision, places=places, split=split, constants=ones if free else []
    )


def _gaps(problem: Problem, f: Fitted | None) -> list[Floats]:
    """Gaps (n, 3) mm of the tip per run that the causes, fitted without it, leave."""
    if f is None:
        return [problem.bench.gap(k)[:, :3] for k in range(len(problem.bench.runs))]
    return [_gap(problem, f, k, problem.determined_without(f, k)[0]) for k in range(len(problem.bench.runs))]


def _gap(problem: Problem, f: Fitted, k: int, theta: Floats) -> Floats:
    return problem.bench.gap(k, problem.causes(f.members, theta, f.extra))[:, :3]


def _beside(problem: Problem, f: Fitted | None, bench: TermBench, found: FoundLaw) -> tuple[list[Floats], list[Floats]]:
    """Gaps and signal, as in LawAnswer, of a law fitted jointly with the causes of f, or alone where f is None."""
    signal, gaps = moved_without(bench, found), _gaps(problem, None)
    if f is not None and f.members:
        theta = found.folds.means(found.columns, found.precision)[:, problem.member_columns(f.members)]
        whole = found.folds.split.parts == 1  # runs are withheld
        gaps = [_gap(problem, f, k, theta[1 + k] if whole else theta[0]) for k in range(len(problem.bench.runs))]
    return gaps, signal


def rms_um(gaps: Sequence[Floats], signal: Sequence[Floats] = ()) -> float:
    """Rms (um) of gaps (n, 3) mm less signals (n, 3) mm over the rows with a measurement."""
    left = [g - s for g, s in zip(gaps, signal, strict=True)] if signal else gaps
    each = np.concatenate([np.nansum(g**2, axis=1)[np.isfinite(g).any(axis=1)] for g in left])
    return 1e3 * float(np.sqrt(np.mean(each))) if len(each) else 0.0


def with_law(problem: Problem, found: FoundLaw) -> Problem:
    """The problem with the terms of a law as further nuisances, with the prior of its coefficients."""
    more, old, columns = len(found.precision), problem.prior, problem.columns
    prior = Prior(
        np.concatenate([old.tolerance, found.precision**-0.5]),
        np.concatenate([old.sign, np.zeros(more)]),
        np.concatenate([old.reach, np.full(more, np.inf)]),
    )
    white = [ByChannel.joined([W, *(x[k] for x in found.columns)]) for k, W in enumerate(problem.white)]
    names = (*columns.names, *(f"law.{i}" for i in range(more)))
    candidate = np.concatenate([columns.candidate, np.full(more, -1)])
    return replace(problem, columns=replace(columns, candidate=candidate, names=names, prior=prior), white=white)


def fit_needed(problem: Problem, members: Members) -> Fitted:
    """The most probable fit of all or some of the members, none of them small; a cause named without a law may have followed it."""
    fits = [problem.refit(some) for some in parts_of(members)]
    temperature = temperature_of(fits[0], problem.prior, problem.member_columns(members))
    kept = [f for f in fits if not problem.small_members(f)]
    return max(kept, key=lambda f: problem.candidates.value(f, temperature))
