"""Loaded structure along one run: solved at the nodes of its path, and extended by first derivatives.

Values that many readings of a run share (between the nodes, under the usual load) are computed once.
"""

from __future__ import annotations

from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from camcomp.ground.compiled import kept
from camcomp.ground.datatypes import Floats
from camcomp.ground.records import dataclass, field
from camcomp.model.effect import Load
from camcomp.model.motion.node_pieces import Places
from camcomp.model.motion.run_path import RunPath


@dataclass(frozen=True, eq=False)
class Softer:
    """Additional response of a changed machine to a force at the tip, against the machine of the slopes, per piece.

    tip (pieces, 3, 3) mm/N; drive (pieces, m, 3) N/N.
    """

    tip: Floats
    drive: Floats


@dataclass(frozen=True, eq=False, kw_only=True)
class Solved:
    """The solved structure at the nodes of a run path, with the drive positions and loads of the solution."""

    key: tuple[Any, ...]
    shift: Floats  # (pieces, m) carriage minus set-point, piece by piece
    load: Load  # (q)
    tip: Floats  # (q, 3) machine frame
    drive: Floats  # (q, m)
    softer: Softer | None = None  # if the loads between nodes differ from those at the nodes
    _tips: WeakKeyDictionary[Places, Floats] = field(default_factory=WeakKeyDictionary, init=False, repr=False)
    _drives: WeakKeyDictionary[Places, Floats] = field(default_factory=WeakKeyDictionary, init=False, repr=False)

    def tips(self, run_path: RunPath, place: Places, at: Floats) -> Floats:
        """Tips (n, 3), machine frame, at times (n,) with interpolation `place`, computed once per `place`."""
        if place not in self._tips:
            self._tips[place] = run_path.tips(self.tip, place, at)
        return self._tips[place]

    def drives(self, place: Places) -> Floats:
        """Drive forces (n, m) between the nodes, computed once per `place`."""
        if place not in self._drives:
            self._drives[place] = place.of(self.drive)
        return self._drives[place]


@dataclass(frozen=True, eq=False)
class Following:
    """First derivatives of a quantity (n, 3 or m) between the nodes by carriages and load.

    by_rho (n, ., m), by_wrench (n, ., 6); at_reference (3, 6) or (n, 3, 6): wrench there per force at the tip. It holds no reference to
    the interpolation, so that the caches can release those of a single reading.
    """

    by_rho: Floats
    by_wrench: Floats
    at_reference: Floats
    _by_usual_load: WeakKeyDictionary[Load, tuple[Floats, Floats]] = field(
        default_factory=WeakKeyDictionary, init=False, repr=False
    )

    def behind(
        self,
        values: Floats,
        place: Places,
        solved: Solved,
        gap: Floats,
        load: Load,
        *,
        usual: bool,
        softer: Floats | None = None,
    ) -> Floats:
        """Values of a solved structure, changed to first order by carriages (n, m) off the solution and by a load (n).

        usual: the load is that of the run path itself, whose contribution is computed once. softer (pieces, ., 3): additional
        response of a changed structure.
        """
        known = self._by_usual_load.get(solved.load) if usual else None
        if known is None:
            force, wrench = load.force - place.of(solved.load.force), load.wrench - place.of(solved.load.wrench)
            known = force, applied(self.by_wrench, wrench + at_reference_of(force, self.at_reference))
        if usual:
            self._by_usual_load[solved.load] = known
        force, by_load = known
        if softer is not None:
            by_load = by_load + np.einsum("nij,nj->ni", softer[place.piece], force)
        out = np.empty(values.shape)
        slope, given = self.by_rho.transpose(1, 2, 0), (values, gap, solved.shift, by_load)
        _behind(np.ascontiguousarray(slope), place.piece, *map(np.ascontiguousarray, given), out)
        return out


@dataclass(frozen=True, eq=False, kw_only=True)
class Slopes:
    """First derivatives at the nodes: of tip and drive force by carriage (q, ., m) and by wrench at the reference (q, ., 6)."""

    tip_rho: Floats
    tip_wrench: Floats
    drive_rho: Floats
    drive_wrench: Floats
    at_reference: Floats  # wrench (3, 6) or (q, 3, 6) there per force at the tip
    key: tuple[Any, ...] = ()  # key of the machine
    _at: WeakKeyDictionary[Places, Slopes] = field(default_factory=WeakKeyDictionary, init=False, repr=False)
    _tips: WeakKeyDictionary[Places, Following] = field(default_factory=WeakKeyDictionary, init=False, repr=False)
    _drives: WeakKeyDictionary[Places, Following] = field(default_factory=WeakKeyDictionary, init=False, repr=False)

    def at(self, place: Places) -> Slopes:
        """Derivatives between the nodes, computed once per `place`."""
        if place not in self._at:
            nodes = (self.tip_rho, self.tip_wrench, self.drive_rho, self.drive_wrench)
            tip_rho, tip_wrench, drive_rho, drive_wrench = (rows_together(place.of(each)) for each in nodes)
            self._at[place] = Slopes(
                tip_rho=tip_rho, tip_wrench=tip_wrench, drive_rho=drive_rho, drive_wrench=drive_wrench,
                at_reference=self.at_reference if self.at_reference.ndim == 2 else place.of(self.at_reference),
                key=self.key,
            )  # fmt: skip
        return self._at[place]

    def tips(self, place: Places) -> Following:
        """Derivatives of the tips between the nodes."""
        if place not in self._tips:
            there = self.at(place)
            self._tips[place] = Following(there.tip_rho, there.tip_wrench, there.at_reference)
        return self._tips[place]

    def drives(self, place: Places) -> Following:
        """Derivatives of the drive forces between the nodes."""
        if place not in self._drives:
            there = self.at(place)
            self._drives[place] = Following(there.drive_rho, there.drive_wrench, there.at_reference)
        return self._drives[place]


@kept
def _behind(slope, piece, values, gap, shift, by_load, out):  # type: ignore[no-untyped-def]  # pragma: no cover
    for t in range(out.shape[0]):
        for i in range(out.shape[1]):
            change = 0.0
            for k in range(gap.shape[1]):
                change += slope[i, k, t] * (gap[t, k] - shift[piece[t], k])
            out[t, i] = values[t, i] + change + by_load[t, i]


def at_reference_of(force: Floats, at_reference: Floats) -> Floats:
    """Wrenches (n, 6) at the platform reference of forces (n, 3) at the tip; at_reference (3, 6) or (n, 3, 6)."""
    if at_reference.ndim == 2:
        return np.asarray(force @ at_reference)
    return np.asarray(np.einsum("ni,nij->nj", force, at_reference))


def applied(slope: Floats, change: Floats) -> Floats:
    """Slopes (n, 3, k) times changes (n, k), fastest with the memory layout of rows_together."""
    rows_last = np.ascontiguousarray(change.T)
    return np.ascontiguousarray(np.einsum("ikn,kn->in", slope.transpose(1, 2, 0), rows_last).T)


def rows_together(slope: Floats) -> Floats:
    """Slopes (n, 3, k) in the memory layout that `applied` needs: the rows of each element are contiguous."""
    return np.ascontiguousarray(slope.transpose(1, 2, 0)).transpose(2, 0, 1)
