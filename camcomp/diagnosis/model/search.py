"""Best-subset search: sets of candidates by log posterior, enlarged from the best of each size, with drops and exchanges."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations, product
from typing import Protocol

import numpy as np

from camcomp.diagnosis.model.candidates import Place, PlacedCause
from camcomp.diagnosis.model.evidence import LONG, Members
from camcomp.ground.datatypes import Floats

MOST = 5  # causes of a set
ROUNDS = 6  # of searches about what was found, at most
KEPT = 12  # sets of each size that are enlarged; of an axis, that are fitted one by one
SLACK = 6.0  # log posterior by which a set may lie behind the best one, and be enlarged or fitted


def best_of(values: Mapping[Members, float]) -> Members:
    """The most probable of sets with their log posteriors."""
    return max(values, key=lambda m: (values[m], m))


def sets_of_places(places: Sequence[Place], most: int) -> list[Members]:
    """All sets of up to `most` candidates, with one of each place at most. places: of the candidates."""
    at = {place: [i for i, each in enumerate(places) if each == place] for place in places}
    some = [own for n in range(most + 1) for own in combinations(at.values(), n)]
    return [tuple(sorted(each)) for own in some for each in product(*own)]


class WeighedSets(Protocol):
    """Log posteriors of sets of candidates, of which those `usable` may be members."""

    @property
    def candidates(self) -> Sequence[PlacedCause]:
        """All candidates."""

    @property
    def usable(self) -> Sequence[int]:
        """Candidates that the data can show."""

    def value(self, members: Members) -> float:
        """Log posterior of a set, up to a constant."""

    def with_one_more(self, members: Members, more: Sequence[int]) -> Floats:
        """Log posterior (m,) of a set with one of `more` each."""


def search_sets(data: WeighedSets, most: int = MOST) -> dict[Members, float]:
    """Sets of up to `most` causes with their log posteriors.

    A set has at most one candidate of more than LONG columns, which is tried with the best set of each size.
    """
    candidates = data.candidates
    usable = data.usable
    long = {i for i in usable if len(candidates[i].columns) > LONG}
    values: dict[Members, float] = {(): data.value(())}

    def enlarge(members: Members) -> list[Members]:
        if len(members) == most:
            return []
        taken = {candidates[i].place for i in members}
        full = bool(long & set(members)) or members not in leaders
        more = [i for i in usable if candidates[i].place not in taken and not (full and i in long)]
        grown = {tuple(sorted((*members, i))): i for i in more}
        new = {each: i for each, i in grown.items() if each not in values}
        if new:
            values.update(zip(new, data.with_one_more(members, list(new.values())).tolist(), strict=True))
        return list(grown)

    front: list[Members] = [()]
    leaders: set[Members] = {()}
    for size in range(1, most + 1):
        found = {each for members in front for each in enlarge(members)}
        front = sorted(found, key=lambda m: (-values[m], m))[: KEPT if size > 1 else 2 * KEPT]
        leaders |= set(front[:1])
        if not front or (size > 1 and values[front[0]] < max(values.values()) - SLACK):
            break
    best = None
    while best != (best := best_of(values)):
        leaders.add(best)
        for k in range(len(best)):
            less = (*best[:k], *best[k + 1 :])
            if less not in values:
                values[less] = data.value(less)
            enlarge(less)
    return {m: v for m, v in values.items() if np.isfinite(v)}
