"""The law in the answer of a diagnosis: what is left of the gap with it, on parts that it was not fitted to."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from camcomp.diagnosis.fit.gap import main_channels
from camcomp.diagnosis.fit.problem import Problem
from camcomp.diagnosis.law.bench_terms import TermBench, spots
from camcomp.diagnosis.law.describe import law_result, moved_without, terms_of
from camcomp.diagnosis.law.find import FoundLaw, find_law
from camcomp.diagnosis.law.folds import Folds, parts_of
from camcomp.diagnosis.law.smooth import FoundMap, find_map, map_values
from camcomp.diagnosis.result.types import Law
from camcomp.diagnosis.search.unknown import about
from camcomp.diagnosis.statistics.cause_sets import Fitted
from camcomp.ground.datatypes import Floats

GOOD_ENOUGH = 0.4  # of the floor, or of what was there: what a law may leave before a map is tried
BETTER = 0.8  # of what a law leaves: what a map has to leave to be told instead
LEAST_SHRINKAGE = 0.1  # of the gap on withheld parts, below which nothing was found


@dataclass(frozen=True, eq=False)
class LawAnswer:
    """law: as in the result; gaps (n, 3) mm of the tip per run, without it; signal: what it does to the tip (n, 3) mm per run, fitted without what it is judged on; found:
    its terms.
    """

    law: Law
    gaps: tuple[Floats, ...]
    signal: tuple[Floats, ...]
    found: FoundLaw | FoundMap


def answer_law(problem: Problem, f: Fitted, kind: str) -> LawAnswer | None:
    """The law or map that an unknown effect in a kind of channel follows; None where none holds on withheld parts."""
    if main_channels(problem).start != 0 or kind not in ("tip", "encoder"):
        return None
    bench = term_bench(problem)
    gaps = _gaps(problem, f)
    before = _rms(gaps)
    floor = problem.floor.tip_um
    folds, firm = _folds(problem, f, bench, kind)
    found: FoundLaw | FoundMap | None = find_law(bench, folds, firm, kind)
    signal = _signal(bench, found) if found is not None else []
    after = _rms(gaps, signal) if found is not None else before
    left, room = max(after**2 - floor**2, 0.0) ** 0.5, max(before**2 - floor**2, 0.0) ** 0.5
    if left > GOOD_ENOUGH * floor and left > GOOD_ENOUGH * room and kind == "tip":
        smooth = find_map(bench, firm, kind)
        if smooth is not None:
            other = _signal(bench, smooth)
            if _rms(gaps, other) < BETTER * after:
                found, signal, after = smooth, other, _rms(gaps, other)
    if found is None or after > (1.0 - LEAST_SHRINKAGE) * before:
        return None
    return LawAnswer(law_result(bench, found, before, after), tuple(gaps), tuple(signal), found)


def term_bench(problem: Problem) -> TermBench:
    """Where terms are evaluated for a problem."""
    return TermBench(problem.bench, problem.noise, problem.inflate, problem.times)


def _folds(problem: Problem, f: Fitted, bench: TermBench, kind: str) -> tuple[Folds, Folds]:
    """What stands beside a law: everything of the problem, with a free constant at every spot of the tip, and without."""
    white, residual = about(problem, f)
    precision, members = problem.prior.precision(1.0), problem.member_columns(f.members)
    precision[members] = 1.0 / (10.0 * problem.prior.scale[members]) ** 2
    parts = parts_of([problem.row_places(k) for k in range(len(residual))])
    tips = [s for s in spots(len(problem.bench.actuators), kind) if s.on != "drive"]
    ones = [bench.white(s, [np.ones((r.rows, 1)) for r in bench.rows(s)]) for s in tips]
    return Folds(white, residual, precision, parts, ones), Folds(white, residual, precision, parts, [])


def _gaps(problem: Problem, f: Fitted) -> list[Floats]:
    """Gap (n, 3) mm of the tip per run that the causes, fitted without it, leave."""
    out = []
    for k in range(len(problem.bench.runs)):
        causes = problem.causes(f.members, problem.theta_without(f, k), f.extra)
        out.append(problem.bench.gap(k, causes)[:, :3])
    return out


def _signal(bench: TermBench, found: FoundLaw | FoundMap) -> list[Floats]:
    values = [map_values(bench, each) for each in found.maps] if isinstance(found, FoundMap) else []
    return moved_without(bench, found, terms_of(bench, found, values))


def _rms(gaps: Sequence[Floats], signal: Sequence[Floats] = ()) -> float:
    left = [g - s for g, s in zip(gaps, signal, strict=True)] if signal else gaps
    each = np.concatenate([np.nansum(g**2, axis=1)[np.isfinite(g).any(axis=1)] for g in left])
    return 1e3 * float(np.sqrt(np.mean(each))) if len(each) else 0.0
