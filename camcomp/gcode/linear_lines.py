"""Linear moves, compiled: nothing but N, G0 or G1, X, Y, Z and F, each once, with plain numbers.

Most lines of long programs are of this kind. Whatever else stands in a line leaves it to the interpreter;
so does a number that this reader could read differently from it in the last bit.
"""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
# numba infers the types of these functions; written by hand they would only be repeated.

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from camcomp.ground.compiled import entry
from camcomp.ground.datatypes import LINE, RAPID, Floats, Ints

# Columns of LinearMotions.begin and LinearMotions.finish.
X, Y, Z, F, G = range(5)
NOT_LINEAR, FULL, MORE, END = (
    0,
    1,
    2,
    3,
)  # why a scan stopped: a line that is no linear motion, no room, the buffer ends within a line, the end
LONGEST_END = 4  # bytes of an end of line, CR CR CR LF; see text.END_OF_LINE
_LARGEST_WORD = 1.0e7  # mm, as the interpreter has it
_POWERS = 10.0 ** np.arange(23)


class LinearMotions(NamedTuple):
    """Motions of consecutive linear moves, n of them."""

    row: Ints  # (n,) line, counted from the first line of the scan
    begin: NDArray[np.int32]  # (n, 5) index of each word's letter, -1 when the word is not there
    finish: NDArray[np.int32]  # (n, 5) index behind each word
    kind: np.ndarray  # (n,) RAPID or LINE
    start: Floats  # (n, 3) mm
    end: Floats  # (n, 3) mm
    feed: Floats  # (n,) mm/min in force, also at rapids
    code_stated: np.ndarray  # (n,) as in Sites
    feed_stated: np.ndarray

    @staticmethod
    def room(n: int) -> LinearMotions:
        """Arrays for n motions."""
        return LinearMotions(
            row=np.empty(n, np.int64), begin=np.empty((n, 5), np.int32), finish=np.empty((n, 5), np.int32),
            kind=np.empty(n, np.int8), start=np.empty((n, 3)), end=np.empty((n, 3)), feed=np.empty(n),
            code_stated=np.empty(n, np.bool_), feed_stated=np.empty(n, np.bool_),
        )  # fmt: skip

    def take(self, a: int, b: int) -> LinearMotions:
        """Motions a to b, as views."""
        return LinearMotions(*(each[a:b] for each in self))  # type: ignore[arg-type]


def scan(*args: Any) -> tuple[Any, ...]:
    """scan_lines with room to work in."""
    out: tuple[Any, ...] = scan_lines(*args, np.empty(5, np.int64), np.empty(5, np.int64), np.zeros(5))
    return out


@entry
def scan_lines(data, at, stop, last, code, feed, code_stated, feed_stated, position, unit, offset, pointed, out, limit,
               begin, finish, value):  # fmt: skip
    """Reads linear moves from index `at` of the bytes `data` (up to `stop`) into `out`, at most `limit` motions.

    last: the file ends at `stop`. code: 0, 1 or -1 (none of them in force), feed in force (0: none), position (3,) mm,
    unit mm, offset (3,) mm. pointed: numbers without a point are left to the interpreter. Returns (motions, rows, index, reason, code, feed,
    code_stated, feed_stated); `position` is moved along. begin, finish, value (5,): room to work in.
    """
    n = 0
    row = 0
    while at < stop:
        if n == limit:
            return n, row, at, FULL, code, feed, code_stated, feed_stated
        for k in range(5):
            begin[k] = -1
        i = at
        linear = True
        first = True
        while True:
            if i >= stop:
                if not last:
                    return n, row, at, MORE, code, feed, code_stated, feed_stated
                break
            c = data[i]
            if c == 32 or c == 9:
                i += 1
                continue
            if c == 10 or c == 13:
                break
            here = i
            letter = c & 0xDF
            i += 1
            # the number: sign, digits, point, digits
            negative = False
            if i < stop and (data[i] == 45 or data[i] == 43):
                negative = data[i] == 45
                i += 1
            mantissa = 0
            digits = 0
            decimals = 0
            point = False
            while i < stop:
                d = data[i]
                if 48 <= d <= 57:
                    mantissa = mantissa * 10 + (d - 48)
                    digits += 1
                    if point:
                        decimals += 1
                    if digits > 15:
                        break
                elif d == 46 and not point:
                    point = True
                else:
                    break
                i += 1
            if i >= stop and not last:
                return n, row, at, MORE, code, feed, code_stated, feed_stated
            if digits == 0 or digits > 15:
                linear = False
                break
            if letter == 78:  # N
                if not first or point or negative:
                    linear = False
                    break
                first = False
                continue
            first = False
            k = -1
            if 88 <= letter <= 90:
                k = letter - 88
            elif letter == 70:
                k = F
            elif letter == 71:
                k = G
            if k < 0 or begin[k] >= 0 or (k == G and (point or negative or mantissa > 1)):
                linear = False
                break
            if k < 3 and pointed and not point and mantissa != 0:
                linear = False
                break
            # `X1 0` is one number or two: the interpreter refuses it
            j = i
            while j < stop and (data[j] == 32 or data[j] == 9):
                j += 1
            if j < stop and (48 <= data[j] <= 57 or data[j] == 46 or data[j] == 44 or data[j] == 43 or data[j] == 45):
                linear = False
                break
            begin[k] = here
            finish[k] = i
            number = mantissa / _POWERS[decimals]
            value[k] = -number if negative else number
        if not linear:
            return n, row, at, NOT_LINEAR, code, feed, code_stated, feed_stated
        eol = i
        if i < stop and data[i] == 13:
            while i < stop and data[i] == 13 and i - eol < LONGEST_END:
                i += 1
            if i >= stop and not last:
                return n, row, at, MORE, code, feed, code_stated, feed_stated
            if i < stop and data[i] == 10 and i - eol < LONGEST_END:
                i += 1
            else:
                i = eol + 1
        elif i < stop:
            i += 1
        now = code
        stated = code_stated
        if begin[G] >= 0:
            now = 1 if value[G] == 1.0 else 0
            stated = True
        speed = feed
        fed = feed_stated
        if begin[F] >= 0:
            speed = value[F] * unit
            fed = True
            if not speed > 0.0:
                return n, row, at, NOT_LINEAR, code, feed, code_stated, feed_stated
        moves = begin[X] >= 0 or begin[Y] >= 0 or begin[Z] >= 0
        if moves and (now < 0 or (now == 1 and not speed > 0.0)):
            return n, row, at, NOT_LINEAR, code, feed, code_stated, feed_stated
        if moves:
            for k in range(3):
                if begin[k] >= 0 and abs(value[k] * unit) > _LARGEST_WORD:
                    return n, row, at, NOT_LINEAR, code, feed, code_stated, feed_stated
            for k in range(3):
                out.start[n, k] = position[k]
                if begin[k] >= 0:
                    position[k] = value[k] * unit + offset[k]
                out.end[n, k] = position[k]
            for k in range(5):
                out.begin[n, k] = begin[k]
                out.finish[n, k] = finish[k] if begin[k] >= 0 else -1
            out.row[n] = row
            out.kind[n] = LINE if now == 1 else RAPID
            out.feed[n] = speed if speed > 0.0 else np.nan
            out.code_stated[n] = stated
            out.feed_stated[n] = fed
            stated = False
            fed = False
            n += 1
        code = now
        feed = speed
        code_stated = stated
        feed_stated = fed
        at = i
        row += 1
    return n, row, at, END, code, feed, code_stated, feed_stated
