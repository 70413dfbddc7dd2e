"""The result of the search for a law."""

from __future__ import annotations

from dataclasses import dataclass

from camcomp.diagnosis.fit.problem import Problem
from camcomp.diagnosis.law.bench_terms import TermBench
from camcomp.diagnosis.law.find import FoundLaw
from camcomp.diagnosis.law.smooth import FoundMap
from camcomp.diagnosis.result.types import Law
from camcomp.diagnosis.statistics.cause_sets import Fitted
from camcomp.ground.datatypes import Floats


@dataclass(frozen=True, eq=False, kw_only=True)
class LawAnswer:
    """law: as in the result; before: gaps (n, 3) mm of the tip per run that the causes alone leave; gaps: what they leave as they
    stand beside the law; signal: what it does to the tip (n, 3) mm per run; all fitted without what they are judged on; found: its
    terms; problem: with the law in it; fit: the causes that stand there, fitted together with it.
    """

    law: Law
    before: tuple[Floats, ...]
    gaps: tuple[Floats, ...]
    signal: tuple[Floats, ...]
    found: FoundLaw | FoundMap
    problem: Problem
    fit: Fitted


def term_bench(problem: Problem) -> TermBench:
    """Where terms are evaluated for a problem."""
    return TermBench(problem.bench, problem.noise, problem.inflate, problem.times)
