"""Writes linear moves with other end points, compiled: byte for byte what rewrite.py writes for such lines.

The control is followed through the output: position after rounding, motion code, feed. Between runs of linear moves the
caller carries these on.
"""

# mypy: disallow-untyped-defs=False, disallow-incomplete-defs=False
# numba infers the types of these functions; written by hand they would only be repeated.

from __future__ import annotations

from typing import Any

import numpy as np

from camcomp.gcode.linear_lines import F, G
from camcomp.ground.compiled import entry, inner
from camcomp.ground.datatypes import RAPID, Floats, Ints

FEED_SLACK = 1.0e-3
MAX_ROW_BYTES = 128  # bytes that a row needs at most, beside its line
CELL_BYTES = 32  # bytes that a cell needs at most
_LARGEST_NUMBER = 9.0e9  # a larger number with nine decimals does not fit into 64 bits
_TENS = 10 ** np.arange(19, dtype=np.uint64)  # unsigned: their quotients need no rounding of negative ones
_TEN, _NOUGHT = np.uint64(10), np.uint64(48)  # and the character 0
_POWERS = _TENS.astype(float)


@inner
def put_decimal(out, at, value, digits, point):
    """Writes `value` rounded to `digits` decimals as numbers.linear does; the index behind it."""
    scaled = np.rint(value * _POWERS[digits])
    if scaled < 0.0:
        out[at] = 45
        at += 1
    whole = np.uint64(abs(scaled))
    while digits > 0 and whole % _TEN == 0:
        whole //= _TEN
        digits -= 1
    at = put_number(out, at, whole, digits)
    if point and digits == 0:
        out[at] = 46
        out[at + 1] = 48
        at += 2
    return at


@inner
def put_number(out, at, whole, digits):
    """Writes a whole number with a point in front of its last digits, if there are any; the index behind it."""
    n = digits + 1
    while n < 19 and whole >= _TENS[n]:
        n += 1
    point = at + n - digits
    if digits > 0:
        whole = put_digits(out, point + 1, point + 1 + digits, whole)
        out[point] = 46
    put_digits(out, at, point, whole)
    return point + digits + (1 if digits > 0 else 0)


@inner
def put_digits(out, begin, end, whole):
    """Fills out[begin:end] with the last digits of a whole number; the number in front of them."""
    for k in range(end - 1, begin - 1, -1):
        rest = whole // _TEN
        out[k] = _NOUGHT + (whole - rest * _TEN)
        whole = rest
    return whole


@inner
def put_feed(out, at, value, point):
    """Writes a feed with six significant digits, as numbers.significant does."""
    if not value > 0.0:
        out[at] = 48
        return at + 1
    digits = 5 - int(np.floor(np.log10(value)))
    return put_decimal(out, at, value, min(max(digits, 0), 17), point)


@inner
def copy(out, at, data, begin, finish):
    """Copies bytes; the index behind them."""
    for k in range(begin, finish):
        out[at] = data[k]
        at += 1
    return at


@inner
def put_eol(out, at, data, begin, finish):
    """Copies an end of line, or writes LF where there is none to copy; the index behind it."""
    if begin == finish:
        out[at] = 10
        return at + 1
    return copy(out, at, data, begin, finish)


def write_rows(*args: Any) -> int:
    """write_lines with room to work in."""
    out: int = write_lines(*args, np.empty(3), np.empty(3), np.empty(3, np.bool_))
    return out


@entry
def write_lines(data, text_at, text_end, lines, begin, finish, kind, programmed, code_stated, feed_stated, program_feed,
                first, joining, commanded, feed, position, state, unit, offset, digits, half, feed_point, out, written, held, value, goes, fresh):  # fmt: skip
    """The bytes text_at..text_end of `data`, which hold n motions, with N rows in their place.

    lines (n, 3): index of the begin and the end of every line, and behind its end of line. begin and finish (n, 5),
    kind (n,), programmed (n, 3) mm, program_feed (n,): see linear_lines.LinearMotions.
    first (n + 1,): rows of every motion. joining (N,), commanded (N, 3) mm, feed (N,) mm/min (NaN: as programmed).
    position (3,) mm and state (2,) = motion code in force (-1 unknown), feed in force (NaN unknown):
    carried on. feed_point: whole feeds have a point. Fills out (bytes), written (N, 3) mm, held (N,): feed in force
    behind the row, mm/min. Returns the number of bytes. value, goes, fresh (3,): room to work in.
    """
    at = 0
    copied = text_at
    for i in range(lines.shape[0]):
        # the words of the line, and how its letters stand
        first_word = -1
        last_shape = -1
        lower = False
        packed = False
        for k in range(5):
            b = begin[i, k]
            if b < 0:
                continue
            if k != G and (first_word < 0 or b < first_word):
                first_word = b
            if k < 3 and data[b] >= 97:
                lower = True
            if k != F and finish[i, k] > last_shape:
                last_shape = finish[i, k]
            if b > lines[i, 0] and 48 <= data[b - 1] <= 57:
                packed = True
        eol_begin, eol_end = lines[i, 1], lines[i, 2]
        behind = eol_begin
        if eol_begin == eol_end and i > 0:  # the last line of the file
            eol_begin, eol_end = lines[i - 1, 1], lines[i - 1, 2]
        if code_stated[i]:
            state[0] = -1.0 if begin[i, G] >= 0 else (0.0 if kind[i] == RAPID else 1.0)
        if feed_stated[i]:
            state[1] = np.nan if begin[i, F] >= 0 and kind[i] != RAPID else program_feed[i]
        main = first[i]
        while main < first[i + 1] - 1 and joining[main]:
            main += 1
        at = copy(out, at, data, copied, lines[i, 0])
        copied = lines[i, 0]
        code = 0.0 if kind[i] == RAPID else 1.0
        for row in range(first[i], first[i + 1]):
            new = row != main
            target = commanded[row]
            for k in range(3):
                stays = position[k]
                if not new and begin[i, k] >= 0:
                    stays = programmed[i, k]
                fresh[k] = abs(stays - target[k]) > half
                goes[k] = stays
                if fresh[k]:
                    value[k] = np.rint((target[k] - offset[k]) / unit * _POWERS[digits]) / _POWERS[digits]
                    goes[k] = value[k] * unit + offset[k]
                    fresh[k] = goes[k] != stays
            want = program_feed[i] if np.isnan(feed[row]) else feed[row]
            if row > main:
                at = copy(out, at, data, copied, behind)
                copied = behind
                at = put_eol(out, at, data, eol_begin, eol_end)
            if new:
                if not (fresh[0] or fresh[1] or fresh[2]):
                    fresh[0] = True
                    value[0] = np.rint((position[0] - offset[0]) / unit * _POWERS[digits]) / _POWERS[digits]
                    goes[0] = value[0] * unit + offset[0]
                word = False
                if state[0] != code:
                    out[at] = 103 if lower else 71
                    out[at + 1] = 48 + int(code)
                    at += 2
                    state[0] = code
                    word = True
                for k in range(3):
                    if fresh[k]:
                        if word and not packed:
                            out[at] = 32
                            at += 1
                        out[at] = (120 if lower else 88) + k
                        at = put_decimal(out, at + 1, value[k], digits, True)
                        word = True
                if kind[i] != RAPID and not abs(want - state[1]) <= FEED_SLACK * state[1]:
                    if word and not packed:
                        out[at] = 32
                        at += 1
                    out[at] = 102 if lower else 70
                    at = put_feed(out, at + 1, want / unit, feed_point)
                    state[1] = want
                if row < main:
                    at = put_eol(out, at, data, eol_begin, eol_end)
            else:
                # in place: walk through the line's words in their order
                state_code = state[0]
                state[0] = code
                done = copied
                for _ in range(5):
                    word_at = -1
                    which = -1
                    for k in range(5):
                        b = begin[i, k]
                        if b >= done and (word_at < 0 or b < word_at):
                            word_at = b
                            which = k
                    if which < 0:
                        break
                    at = copy(out, at, data, done, word_at)
                    if word_at == first_word and begin[i, G] < 0 and state_code != code:
                        out[at] = 103 if lower else 71
                        out[at + 1] = 48 + int(code)
                        at += 2
                        if not packed:
                            out[at] = 32
                            at += 1
                    end = finish[i, which]
                    if which < 3 and fresh[which]:
                        out[at] = data[word_at]
                        at = put_decimal(out, at + 1, value[which], digits, True)
                    elif which == F and kind[i] != RAPID:
                        if abs(want - program_feed[i]) <= FEED_SLACK * program_feed[i]:
                            at = copy(out, at, data, word_at, end)
                            state[1] = program_feed[i]
                        else:
                            out[at] = data[word_at]
                            at = put_feed(out, at + 1, want / unit, feed_point)
                            state[1] = want
                    else:
                        at = copy(out, at, data, word_at, end)
                    done = end
                    if end == last_shape:
                        for k in range(3):
                            if begin[i, k] < 0 and fresh[k]:
                                if not packed:
                                    out[at] = 32
                                    at += 1
                                out[at] = (120 if lower else 88) + k
                                at = put_decimal(out, at + 1, value[k], digits, True)
                        if kind[i] != RAPID and begin[i, F] < 0 and not abs(want - state[1]) <= FEED_SLACK * state[1]:
                            if not packed:
                                out[at] = 32
                                at += 1
                            out[at] = 102 if lower else 70
                            at = put_feed(out, at + 1, want / unit, feed_point)
                            state[1] = want
                copied = done
            for k in range(3):
                position[k] = goes[k]
                written[row, k] = goes[k]
            held[row] = state[1]
    at = copy(out, at, data, copied, text_end)
    return at


# --- tables ----------------------------------------------------------------------------------------------------------


def csv_rows(line: Ints, values: Floats, decimals: Ints) -> bytes:
    """Rows of a source line (n,) and values (n, k) with decimals (k,); NaN is an empty cell, minus zero is zero."""
    out = np.empty(len(line) * (values.shape[1] + 1) * CELL_BYTES, np.uint8)
    return out[: put_rows(line, np.ascontiguousarray(values), decimals, out)].tobytes()


@entry
def put_rows(line, values, decimals, out):
    """Fills out with the text; the number of bytes."""
    at = 0
    for i in range(line.shape[0]):
        at = put_number(out, at, np.uint64(line[i]), 0)
        for k in range(values.shape[1]):
            out[at] = 44
            at += 1
            value = values[i, k]
            if not abs(value) < _LARGEST_NUMBER:
                continue
            whole = np.uint64(np.rint(abs(value) * _POWERS[decimals[k]]))
            if whole > 0 and value < 0.0:
                out[at] = 45
                at += 1
            at = put_number(out, at, whole, decimals[k])
        out[at] = 10
        at += 1
    return at
