"""Interpolate the response of the loaded machine between exact solutions, for programs of very many points.

Space is divided into cubes; where the program comes through one, the machine is solved exactly at some hundred points of
the cube and of the range of forces, and polynomials in position and force are fitted to the answers. Further exact
solutions, not used in the fit, measure its error. A cube with too large an error is divided into eight; where that does
not help (near singular configurations, at the border of the workspace) its points are solved exactly, one by one.

The cubes depend on the machine, the range of forces and the origin of the programs: files keep them for later programs.
The name and the content of a file say which cubes it holds; those of other sources of the solver are not used. A file is a
copy of what is computed without it, so that outputs do not depend on whether it is there.
"""

from __future__ import annotations

import hashlib
from contextlib import suppress
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from camcomp.compensation.long.kernel import (
    BASIC,
    BIAS,
    EXACT,
    LEVELS,
    MOST_DEGREE,
    SPLIT,
    exponents,
    find_tiles,
    look_up,
    put_cells,
)
from camcomp.ground.datatypes import Floats, Ints
from camcomp.ground.errors import FileError
from camcomp.ground.machine_code import CodeFiles, digest, find_folder
from camcomp.ground.records import dataclass, replace
from camcomp.ground.vectors import shifted
from camcomp.model.statics.machine import Machine
from camcomp.model.statics.solve import FREE, TARGET, in_pieces, solve

CELL_MM = 24.0  # mm, edge of the largest cubes
ALLOWED = 2.5e-5  # mm, error of a tile at its test points; half of what a program's points may show at the end
DRIVE_ALLOWED = 1e-4  # of the largest drive force in the tile
TESTS = 64
RATIO = 1.4  # exact solutions per coefficient
RUNGS = (
    (4, 2),
    (5, 4, 2, 0),
    (5, 5, 3, 1),
    (6, 6, 4, 2),
)  # degree in position, by degree in force; tried in this order
SHIFT_STEPS = 4
EVEN = 1.1127756842787055 ** -np.arange(1.0, 7.0)  # multiples fill the cube evenly; the root of x^7 = x + 1
NARROW = 6.0  # a force component so many times smaller than the largest needs a degree less in position
WIDER = 1.25  # limits of the force range are powers of it, so that programs with about the same forces share cubes
NO_FORCE_N = 1e-9
SLICE = 1 << 14  # rows that a thread takes at once
MOST_FILES = 16
_ZERO = np.zeros(3)


@dataclass(frozen=True, eq=False, kw_only=True)
class Basis:
    """A rung of the ladder: normalised sample points in [-1, 1], and the matrices that turn answers into coefficients."""

    position: Ints  # (np, 3) exponents
    force: Ints  # (nf, 3)
    count: Ints  # (nf,) position terms that go with each force term
    degree: tuple[int, int]

    @staticmethod
    def of(degrees: tuple[int, ...], narrow: Ints) -> Basis:
        """The basis of these degrees; every power of a force component takes `narrow` (3,) of them away."""
        a, b = exponents(max(degrees)), exponents(len(degrees) - 1)
        degree = np.array(degrees)[b.sum(axis=1)] - b @ narrow
        count = (a.sum(axis=1) <= degree[:, None]).sum(axis=1)
        return Basis(position=a, force=b, count=count, degree=(max(degrees), len(degrees) - 1))

    @cached_property
    def samples(self) -> Floats:
        """Sample points (TESTS + k, 6), the test points first."""
        k = int(RATIO * self.count.sum())
        return np.asarray(np.cos(np.pi * (np.arange(1, k + TESTS + 1)[:, None] * EVEN % 1.0)))

    @cached_property
    def _terms(self) -> tuple[Floats, Floats]:
        return _products(self.samples, self.position, self.force, self.count)

    @cached_property
    def solve_both(self) -> Floats:
        """(sum of count, k)"""
        return _pseudoinverse(self._terms[0][TESTS:])

    @cached_property
    def solve_position(self) -> Floats:
        """(np, k)"""
        return _pseudoinverse(self._terms[1][TESTS:])

    @property
    def both(self) -> Floats:
        """(TESTS, sum of count) terms at the test points"""
        return self._terms[0][:TESTS]

    @property
    def alone(self) -> Floats:
        """(TESTS, np)"""
        return self._terms[1][:TESTS]

    def terms(self, points: Floats) -> Floats:
        """Terms (n, sum of count) at points (n, 6)."""
        return _products(points, self.position, self.force, self.count)[0]


def _fours(count: Any) -> Any:
    """Counts, up to the next multiples of four, as the compiled look-up takes terms."""
    return -(-count // 4) * 4


def _in_fours(coefficients: Floats, counts: Ints) -> Floats:
    """Coefficients (sum of counts, k), output by output (k, .), with zeros behind every count up to the next multiple of four."""
    parts = np.split(coefficients.T, np.cumsum(counts)[:-1], axis=1)
    return np.concatenate([np.pad(each, ((0, 0), (0, -each.shape[1] % 4))) for each in parts], axis=1)


def _pseudoinverse(terms: Floats) -> Floats:
    """Turns answers into coefficients, by least squares; the terms are known to be independent."""
    return np.asarray(np.linalg.solve(terms.T @ terms, terms.T), float)


def _snake(points: Floats) -> Ints:
    """An order of points in which neighbours lie near each other, because each is solved from the one before."""
    layer = np.minimum(((points[:, 2] + 1.0) * 2.5).astype(int), 4)
    column = np.minimum(((points[:, 1] + 1.0) * 2.5).astype(int), 4)
    along = np.where((layer * 5 + column) % 2 == 0, points[:, 0], -points[:, 0])
    across = np.where(layer % 2 == 0, column, 4 - column)
    return np.lexsort((along, across, layer))


def _products(points: Floats, position: Ints, force: Ints, count: Ints) -> tuple[Floats, Floats]:
    T = [np.polynomial.chebyshev.chebvander(points[:, k], MOST_DEGREE) for k in range(6)]
    A = np.prod([T[k][:, position[:, k]] for k in range(3)], axis=0)
    B = np.prod([T[3 + k][:, force[:, k]] for k in range(3)], axis=0)
    return np.concatenate([B[:, b, None] * A[:, :n] for b, n in enumerate(count)], axis=1), A


@dataclass(frozen=True, eq=False, kw_only=True)
class Tiles:
    """Everything the compiled code needs; t tiles, machine frame."""

    size: float
    keys: Ints
    values: Ints
    centre: Floats  # (t, 3) from Field.corner
    half: Floats  # (t,)
    rung: Ints  # (t,)
    first: Ints  # (t,) where its coefficients begin
    W: Floats
    slope: Floats  # (t, 3, 3) d loaded tip / d commanded tip at the centre
    rates: Floats  # (t, m, 3) d joints / d tip at the centre
    solved: Ints  # (t,) exact solutions that it was made of


def _outward(limit: Floats) -> Floats:
    """Limits (3,) of at least zero, up to the next powers of WIDER; forces below NO_FORCE_N are zero."""
    force = limit > NO_FORCE_N
    return np.where(force, WIDER ** np.ceil(np.log(np.where(force, limit, 1.0)) / np.log(WIDER) - 1e-9), 0.0)


class TileFiles:
    """The cubes of one machine on disk, in a folder that only the user can change; a damaged file counts as missing."""

    def __init__(self, machine: Machine) -> None:
        own = Path(__file__)
        numbers = hashlib.sha256()
        parts = (*machine.elastic, *machine.rigid, machine.joint_var, machine.start_pose, machine.start_y)
        tools = (machine.robot.tool, machine.nominal.tool, machine.nominal.held_rotation)
        for each in (*parts, *tools, machine.revolute):
            numbers.update(np.ascontiguousarray(each).tobytes())
        self._machine, self._files = numbers.hexdigest(), None
        with suppress(OSError):
            folder, stamp = find_folder(own), digest(own)
            self._files = None if folder is None else CodeFiles(folder, "tiles", stamp)

    def load(self, key: tuple[Any, ...]) -> dict[str, Any] | None:
        """Tiles that were kept; None: there are none."""
        with suppress(Exception):  # a damaged file counts as none
            return self._files.load((self._machine, key)) if self._files is not None else None
        return None

    def save(self, key: tuple[Any, ...], tiles: dict[str, Any] | None) -> None:
        """Keep tiles, and the newest MOST_FILES files. None: forget those of the key."""
        if self._files is None:
            return
        with suppress(OSError, FileError):
            self._files.save((self._machine, key), tiles)
            self._files.leave(MOST_FILES)


class Field:
    """A machine's correction, loaded tip, tilt, drives and joints by interpolation. Machine frame."""

    def __init__(self, machine: Machine, force: Floats, middle: Floats = _ZERO, files: TileFiles | None = None) -> None:
        """Force (n, 3) N: forces that will occur, or some of them. Machines of three actuators.

        middle (3,) mm: centre of a cube; programs lie round their origin, and so in the fewest cubes. files: those that
        keep the tiles for later programs.
        """
        self.machine, self._files = machine, files
        self.corner = middle - 0.5 * CELL_MM
        self.solved = 0  # exact solutions so far
        self._narrower: list[tuple[tuple[Any, ...], Tiles, Tiles]] = []  # of ranges before: key, tiles, as loaded
        self._set_range(force)

    def _set_range(self, force: Floats) -> None:
        low, high = np.minimum(force.min(axis=0), 0.0), np.maximum(force.max(axis=0), 0.0)
        self.low, self.high = -_outward(-low), _outward(high)
        self.force_mid = 0.5 * (self.low + self.high)
        self.force_half = np.maximum(0.5 * (self.high - self.low), 1e-9)
        share = self.force_half / max(1e-3, self.force_half.max())
        self._narrow = (-np.log(share) / np.log(NARROW)).astype(int)
        self.bases = [Basis.of(RUNGS[0], self._narrow)]
        self.tiles = Tiles(
            size=CELL_MM, keys=np.full(1 << 12, -1, np.int64), values=np.zeros(1 << 12, np.int64),
            centre=np.zeros((0, 3)), half=np.zeros(0), rung=np.zeros(0, np.int64), first=np.zeros(0, np.int64),
            W=np.zeros(0), slope=np.zeros((0, 3, 3)), rates=np.zeros((0, len(self.machine.actuators), 3)),
            solved=np.zeros(0, np.int64),
        )  # fmt: skip
        known = None if self._files is None else self._files.load(self._key)
        if known is not None:
            self.tiles = Tiles(**known)
            self.bases = [Basis.of(each, self._narrow) for each in RUNGS[: self.tiles.rung.max(initial=0) + 1]]
        self._loaded = self.tiles
        self.used = np.zeros(len(self.tiles.half), np.bool_)  # tiles with points of the program in them

    @property
    def _key(self) -> tuple[Any, ...]:
        """Numbers on which the tiles depend, besides those of the machine."""
        limits = (self.corner, self.low, self.high)
        return (CELL_MM, ALLOWED, DRIVE_ALLOWED, TESTS, RATIO, RUNGS, *(tuple(each.tolist()) for each in limits))

    def keep(self, sound: bool) -> None:
        """Keep the tiles for later programs; sound: a sample of the program agrees with exact solutions."""
        for key, tiles, loaded in (*self._narrower, (self._key, self.tiles, self._loaded)):
            if self._files is not None and (tiles is not loaded or not sound):
                self._files.save(key, vars(tiles) if sound else None)

    @property
    def reach(self) -> Floats:
        """(m,) mm by which a step of an actuator, mm or rad, counts: a hinge moves what is a metre away."""
        return np.where(self.machine.revolute, 1000.0, 1.0)

    def mark(self, tile: Ints) -> None:
        """Count tiles (n,) as used; negative numbers are none."""
        self.used = np.append(self.used, np.zeros(len(self.tiles.half) - len(self.used), np.bool_))
        self.used[tile[tile >= 0]] = True

    def widen(self, force: Floats) -> None:
        """Let the range hold forces (n, 3) that are going to be asked for; a wider one begins without tiles."""
        limits = zip(force.T, self.low - 1e-9, self.high + 1e-9, strict=True)
        if len(force) and any(each.min() < low or each.max() > high for each, low, high in limits):
            self._narrower.append((self._key, self.tiles, self._loaded))
            self._set_range(np.concatenate((force, [self.low, self.high])))

    def look(self, target: Floats, force: Floats | None, *, every: bool = True) -> tuple[Floats, Floats, Ints]:
        """Answers (n, .) as in look_up for targets (n, 3) under forces (n, 3); nominal joints; tiles (n,), negative: none, answers 0.

        Without forces the joints only. Makes the tiles that are not there yet.
        """
        n, m = len(target), len(self.machine.actuators)
        outputs = 0 if force is None else 9 + 2 * m if every else BASIC
        answer, nominal = np.empty((n, outputs)), np.empty((n, m))
        force = np.zeros((n, 3)) if force is None else force
        self.widen(force)
        near = shifted(target, -self.corner)
        tile = self._tiles_of(near)
        self.mark(tile)
        rows, packed = np.argsort(tile, kind="stable"), self.packed()
        lost, rows = np.split(rows, [np.searchsorted(tile, 0, sorter=rows)])
        answer[lost] = nominal[lost] = 0.0

        def work(some: slice) -> None:
            look_up(rows[some], every, near, force, answer, nominal, tile, *packed)

        in_pieces(work, len(rows), SLICE)
        return answer, nominal, tile

    def _tiles_of(self, points: Floats) -> Ints:
        """Tiles (n,) of points (n, 3) from the corner, made where they are not there yet; negative: there is none."""
        tile, cells = np.empty((2, len(points)), np.int64)
        while True:
            t = self.tiles
            missing = find_tiles(t.keys, t.values, t.size, t.centre, t.half, points, tile, cells)
            if not missing:
                return tile
            self._build(np.unique(cells[:missing]))

    def packed(self) -> tuple[Any, ...]:
        """Arguments of the compiled look-up: tiles, bases. The terms of a basis are the first ones of the largest."""
        t, most = self.tiles, self.bases[-1]
        shape = np.array([(*each.degree, _fours(len(each.position)), len(each.force)) for each in self.bases])
        count = np.zeros((len(self.bases), len(most.force)), np.int64)
        for rung, each in enumerate(self.bases):
            count[rung, : len(each.count)] = _fours(each.count)
        return (
            t.centre, t.half, t.rung, t.first, t.W, self.force_mid, self.force_half, shape, count,
        )  # fmt: skip

    def _build(self, cells: Ints) -> None:
        top = 2 * BIAS
        level = cells // top**3
        index = np.stack((cells // top**2 % top, cells // top % top, cells % top), axis=1) - BIAS
        half = 0.5 * self.tiles.size / (1 << level)
        centre = (2 * index + 1) * half[:, None]
        value = np.empty(len(cells), np.int64)
        for n in range(len(cells)):
            before = self.solved
            tile = self._fit(centre[n], half[n])
            if tile is not None:
                self.tiles = replace(self.tiles, solved=np.append(self.tiles.solved, self.solved - before))
            value[n] = tile if tile is not None else EXACT if level[n] == LEVELS - 1 else SPLIT
        keys, values = self._room(len(cells))
        put_cells(keys, values, cells, value)
        self.tiles = replace(self.tiles, keys=keys, values=values)

    def _room(self, more: int) -> tuple[Ints, Ints]:
        """The hash table, with room for more cells."""
        keys, values = self.tiles.keys, self.tiles.values
        used = int((keys != -1).sum())
        if 2 * (used + more) < len(keys):
            return keys, values
        wide = 4 * max(len(keys), used + more)
        new_keys, new_values = np.full(wide, -1, np.int64), np.zeros(wide, np.int64)
        put_cells(new_keys, new_values, keys, values)
        return new_keys, new_values

    def _fit(self, centre: Floats, half: float) -> int | None:
        """A tile for a cube by the lowest rung that will do, its number.

        None when none of them will, or when a point of the cube has no solution.
        """
        self.solved += 1
        if solve(self.machine, TARGET, (self.corner + centre)[None], force=self.force_mid[None]).status.any():
            return None  # one point before all: the solver tries long before it gives up
        known = np.zeros((0, 0))
        unloaded = np.zeros((0, 0))
        m = len(self.machine.actuators)
        for rung, degrees in enumerate(RUNGS):
            if rung == len(self.bases):
                self.bases.append(Basis.of(degrees, self._narrow))
            basis = self.bases[rung]
            more = self._aimed(basis.samples[len(known) :], centre, half, check=rung == 0)
            if more is None:
                return None
            known = np.concatenate((known, more)) if rung else more
            if not rung:
                answer = self._unloaded(basis.samples[:TESTS], centre, half)
                if answer is None:
                    return None
                unloaded = answer
            loaded, joints = known[:, :-m], known[:, -m:]
            aimed = basis.solve_both @ loaded[TESTS:]
            alone = basis.solve_position @ joints[TESTS:]
            error = np.abs(basis.both @ aimed - loaded[:TESTS]).max(axis=0)
            off = np.abs(basis.alone @ alone - joints[:TESTS]).max(axis=0)
            if self._judge(error, off, np.abs(loaded[:TESTS, 6 : 6 + m]).max(axis=0)) > ALLOWED:
                continue
            shift = basis.solve_both @ self._shift(basis, aimed[:, :3], half)
            if np.abs(basis.both @ shift - unloaded).max() <= ALLOWED:
                both = np.concatenate((aimed[:, :3], shift, aimed[:, 3:]), axis=1)
                return self._append(centre, half, rung, both, alone)
        return None

    def _shift(self, basis: Basis, correction: Floats, half: float) -> Floats:
        """Where the load takes the tip (k, 3) at the samples when the sample itself is commanded.

        That is a point whose correction leads back to the sample: found with the polynomial of the correction, and
        judged at the test points by exact solutions.
        """
        points = basis.samples[TESTS:].copy()
        shift = np.zeros((len(points), 3))
        for _ in range(SHIFT_STEPS):
            points[:, :3] = basis.samples[TESTS:, :3] + shift / half
            shift = -basis.terms(points) @ correction
        return shift

    def _judge(self, error: Floats, off: Floats, drive: Floats) -> float:
        """Largest error, in mm; a share of DRIVE_ALLOWED of the drive forces counts as much as ALLOWED.

        error (6 + 2 m,) as in _aimed, off (m,) of the joints, drive (m,) largest forces.
        """
        m = len(off)
        drives = error[6 : 6 + m] / np.maximum(1.0, drive) * (ALLOWED / DRIVE_ALLOWED)
        return float(max(error[:3].max(), ((off + error[6 + m :]) * self.reach).max(), drives.max()))

    def _aimed(self, samples: Floats, centre: Floats, half: float, check: bool) -> Floats | None:
        """Correction, tilt, drives, change of the joints, joints (k, 6 + 3 m), solved exactly at samples of a cube.

        check: the first TESTS of them are proved to be stable. None: there is no solution somewhere.
        """
        out = np.empty((len(samples), 6 + 3 * len(self.machine.actuators)))
        for rows in (slice(0, TESTS), slice(TESTS, None)) if check else (slice(None),):
            tip, load, order = self._at(samples[rows], centre, half)
            state = solve(self.machine, TARGET, tip, force=load, check=check and rows.start == 0)
            self.solved += len(tip)
            if state.status.any():
                return None
            change = state.rho - state.rho_nominal
            answers = (state.commanded - tip, state.tilt, state.drive, change, state.rho_nominal)
            out[rows][order] = np.concatenate(answers, axis=1)
        return out

    def _unloaded(self, samples: Floats, centre: Floats, half: float) -> Floats | None:
        """Shift (k, 3) of the tip at samples of a cube that are commanded themselves; None: no solution somewhere."""
        tip, load, order = self._at(samples, centre, half)
        state = solve(self.machine, FREE, tip, force=load)
        self.solved += len(tip)
        out = np.empty((len(samples), 3))
        out[order] = state.tip - tip
        return None if state.status.any() else out

    def _at(self, samples: Floats, centre: Floats, half: float) -> tuple[Floats, Floats, Ints]:
        """Tips and forces of samples in an order in which neighbours lie near each other, and the order."""
        order = _snake(samples)
        tips = self.corner + centre + half * samples[order, :3]
        return tips, self.force_mid + self.force_half * samples[order, 3:], order

    def _append(self, centre: Floats, half: float, rung: int, both: Floats, alone: Floats) -> int:
        t, basis = self.tiles, self.bases[rung]
        parts = _in_fours(both, basis.count), _in_fours(alone, np.array([len(alone)]))
        W = np.concatenate([each.ravel() for each in parts])
        # slopes at the centre, for the middle force
        n = basis.count[0]
        slope, rates = np.zeros((3, 3)), np.zeros((alone.shape[1], 3))
        for axis in range(3):
            product = np.ones(len(basis.position))
            for other in range(3):
                product *= (_SLOPE_AT_ZERO if other == axis else _AT_ZERO)[basis.position[:, other]]
            slope[:, axis], rates[:, axis] = product[:n] @ both[:n, 3:6] / half, product @ alone / half
        self.tiles = replace(
            t, centre=np.concatenate((t.centre, centre[None])), half=np.append(t.half, half),
            rung=np.append(t.rung, rung), first=np.append(t.first, len(t.W)), W=np.concatenate((t.W, W)),
            slope=np.concatenate((t.slope, (np.eye(3) + slope)[None])), rates=np.concatenate((t.rates, rates[None])),
        )  # fmt: skip
        return len(t.half)


_AT_ZERO = np.array([1.0, 0.0, -1.0, 0.0, 1.0, 0.0, -1.0, 0.0, 1.0])  # T_n(0)
_SLOPE_AT_ZERO = np.array([0.0, 1.0, 0.0, -3.0, 0.0, 5.0, 0.0, -7.0, 0.0])  # T_n'(0)
