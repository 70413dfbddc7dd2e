"""Runs of straight motions with plain words, written compiled, byte for byte as `rewrite` writes them one by one."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from camcomp.gcode.linear_rows import MAX_ROW_BYTES, write_rows
from camcomp.gcode.numbers import FEED_DIGITS
from camcomp.gcode.output import Output
from camcomp.gcode.path_mode import numbered
from camcomp.gcode.program import LINEAR, Program
from camcomp.ground.datatypes import LINE, RAPID, Bools, Floats, Ints
from camcomp.ground.records import dataclass
from camcomp.ground.vectors import distinct

TIE = 1e-6  # of the last digit: nearer to a tie than this, two ways of rounding may differ
_TENS = 10.0 ** np.arange(18)


@dataclass(frozen=True, eq=False, kw_only=True)
class WrittenRun:
    """Text in the place of some lines, and the state of the controller behind them; r rows."""

    text: str
    ends: Floats  # (r, 3) mm, program frame, as rounded
    feeds: Floats  # (r,) mm/min in force, NaN for rapids
    position: list[float]  # (3,) mm
    code: int | None
    feed: float | None  # mm/min


class LinearWriter:
    """Finds the runs of one program and its output, and writes them."""

    def __init__(self, program: Program, out: Output, resolution_mm: float, bounds: Ints) -> None:
        """Bounds (n + 1,): first row of every motion, and the number of rows."""
        self.program, self.out, self.bounds = program, out, bounds
        self.resolution = resolution_mm

    @cached_property
    def behind(self) -> Ints:
        """(n,) the motion behind the run that every motion belongs to; the motion itself where it is in none."""
        sites, rows = self.program.sites, self.bounds[:-1]
        n = len(rows)
        out = np.arange(n)
        if not n or self.program.text.codec != "latin-1" or self.out.words is not None:
            return out
        linear = self._linear()
        assert self.out.rest is not None and self.out.apart is not None
        keys = (sites.unit, *sites.offset.T, numbered(self.program.modes)[1], self.out.rest[rows], self.out.apart[rows])
        fresh = ~linear
        fresh[1:] |= ~linear[:-1]
        for each in keys:
            fresh[1:] |= each[1:] != each[:-1]
        for rebase in self.program.rebases:
            fresh[rebase.motion : rebase.motion + 1] = True
        fresh[0] = True
        begins = np.flatnonzero(fresh)
        ends = np.append(begins[1:], n)
        behind = np.repeat(ends, ends - begins)
        return np.where(linear, behind, out)

    def _linear(self) -> Bools:
        """Motions (n,) whose lines and rows the compiled writer knows."""
        program, out, sites, path = self.program, self.out, self.program.sites, self.program.path
        text, straight = program.text, (path.kind == RAPID) | (path.kind == LINE)
        linear = path.known & ~path.machine & straight & (sites.code == (path.kind == LINE))
        linear &= ~(sites.fixed | sites.relative | sites.stops | sites.modes_changed)
        linear &= (
            (sites.feed_mode == 94) & (sites.feed_unit == sites.unit) & ~((path.kind == LINE) & np.isnan(path.feed))
        )
        for begin in sites.begin[:, LINEAR:].T:
            linear &= begin < 0
        x, y, z = sites.begin[:, :3].T
        linear &= (x >= 0) | (y >= 0) | (z >= 0)
        linear[1:] &= sites.row[1:] > sites.row[:-1]
        linear &= (text.ends < text.nexts)[sites.row]
        if "/" in text.string:
            rows = np.flatnonzero(linear)
            linear[rows] = [not text.line(row).lstrip(" \t").startswith("/") for row in sites.row[rows].tolist()]
        motion = out.motion
        assert out.rest is not None and out.apart is not None
        first = self.bounds[motion]
        other = (out.kind != path.kind[motion]) | (out.rest != out.rest[first]) | (out.apart != out.apart[first])
        other |= self._is_tied()
        linear[motion[other]] = False
        own = np.zeros(len(linear), np.bool_)
        own[motion[~out.joining]] = True
        return np.asarray(linear & own)

    def _is_tied(self) -> Bools:
        """Rows (N,) with a number that lies half-way between two that can be written."""
        sites, motion = self.program.sites, self.out.motion
        unit, power = sites.unit[motion], np.empty(len(motion))
        for each in distinct(sites.unit):
            power[unit == each] = 10.0 ** self.program.language.digits(self.resolution, each)
        scaled = [(self.out.end[:, k] - sites.offset[motion, k]) / unit * power for k in range(3)]
        feed = np.where(np.isnan(self.out.feed), self.program.path.feed[motion], self.out.feed)
        feed = np.where(feed > 0.0, feed / sites.unit[motion], 1.0)
        feed *= _TENS[np.maximum(FEED_DIGITS - 1 - np.floor(np.log10(feed)), 0.0).astype(np.int64)]
        tied = np.zeros(len(feed), np.bool_)
        for each in (*scaled, feed):
            tied |= np.abs(each - np.floor(each) - 0.5) < TIE
        return tied

    @cached_property
    def _data(self) -> np.ndarray:
        return np.frombuffer(self.program.text.string.encode("latin-1"), np.uint8)

    def write(
        self, a: int, b: int, position: list[float], code: int | None, feed: float | None, half: float
    ) -> WrittenRun:
        """Write motions a to b; position (3,) mm, motion code and feed (mm/min) are those of the controller before them.

        half: mm by which an end point may be off without a change of its word.
        """
        program, sites, path, text = self.program, self.program.sites, self.program.path, self.program.text
        rows = sites.row[a:b]
        lines = np.stack((text.starts[rows], text.ends[rows], text.nexts[rows]), axis=1)
        own = slice(int(self.bounds[a]), int(self.bounds[b]))
        unit, count = float(sites.unit[a]), int(self.bounds[b] - self.bounds[a])
        begin, end = int(lines[0, 0]), int(lines[-1, 1])
        out = np.empty(end - begin + MAX_ROW_BYTES * (count + 1), np.uint8)
        ends, held = np.empty((count, 3)), np.empty(count)
        place = np.array(position, float)
        state = np.array([-1.0 if code is None else float(code), np.nan if feed is None else feed])
        size = write_rows(
            self._data, begin, end, lines, sites.begin[a:b, :LINEAR].copy(), sites.finish[a:b, :LINEAR].copy(),
            path.kind[a:b].copy(), np.ascontiguousarray(path.end[a:b]), sites.code_stated[a:b].copy(), sites.feed_stated[a:b].copy(),
            sites.modal_feed[a:b].copy(), self.bounds[a : b + 1] - self.bounds[a], self.out.joining[own].copy(),
            self.out.end[own].copy(), self.out.feed[own].copy(), place, state, unit, sites.offset[a].copy(),
            program.language.digits(self.resolution, unit), half, program.feed_point, out, ends, held,
        )  # fmt: skip
        feeds = np.where(self.out.kind[own] == RAPID, np.nan, held)
        return WrittenRun(
            text=out[:size].tobytes().decode("latin-1"), ends=ends, feeds=feeds, position=place.tolist(),
            code=None if state[0] < 0.0 else int(state[0]), feed=None if np.isnan(state[1]) else float(state[1]),
        )  # fmt: skip
