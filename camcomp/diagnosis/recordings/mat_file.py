"""Numeric variables of a MATLAB file of level 5 (MATLAB 5 to 7), with checks of all sizes in the file.

Source: The MathWorks, "MAT-File Format", R2023b, chapter "Level 5 MAT-File Format".
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from camcomp.diagnosis.recordings.sampled import SampledColumns, of_values, reading, some
from camcomp.ground.csv_table import MOST_TABLE_BYTES
from camcomp.ground.datatypes import Floats
from camcomp.ground.errors import ConfigError, Location

_NUMBERS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
_HDF5 = b"MATLAB 7.3"
OF_AXIS = ("qg", "qm", "vir")  # set-points and encoder of one axis, m, and its drive signal, N by its factor gtau
_UNITS = {"t": "s", "qg": "m", "qm": "m", "vir": "N"}


@dataclass(frozen=True)
class _Element:
    """A data element: its type, and its bytes."""

    kind: int
    data: memoryview


def read_matlab(data: bytes, name: str) -> list[SampledColumns]:
    """The variables as long as the longest, those of the EMPS benchmark with their units. Raises ConfigError CC452."""
    with reading(name, "a MATLAB file"):
        found = read_mat(data)
    rows = max(map(len, found.values()), default=0)
    if not rows:
        raise ConfigError("CC452", "the file has no variables with numbers", at=Location(name, 1, 1))
    columns = {key: values for key, values in found.items() if len(values) == rows}
    factor = found.get("gtau", np.zeros(0))
    if factor.size == 1:
        columns = {key: values * factor if key == "vir" else values for key, values in columns.items()}
    else:
        columns.pop("vir", None)
    dropped = sorted(set(found) - set(columns) - {"gtau"})
    notes = [f"variables dropped: {some(dropped)}"] if dropped else []
    units = [_UNITS.get(key, "") for key in columns]
    return [of_values(name, list(columns), units, list(columns.values()), time=None, notes=notes)]


def read_mat(data: bytes) -> dict[str, Floats]:
    """Numeric arrays by name, each flattened column by column. Raises ValueError for other files."""
    if data.startswith(_HDF5):
        raise ValueError("it is an HDF5 file; save it with -v7")
    order = {b"IM": "<", b"MI": ">"}.get(data[126:128])
    if order is None:
        raise ValueError("it has no header of level 5")
    found: dict[str, Floats] = {}
    for each in _elements(memoryview(data)[128:], order):
        inside = [each]
        if each.kind == 15:  # miCOMPRESSED
            unpacker = zlib.decompressobj()
            try:
                unpacked = unpacker.decompress(each.data, MOST_TABLE_BYTES)
            except zlib.error as error:
                raise ValueError("a compressed variable is damaged") from error
            if unpacker.unconsumed_tail:
                raise ValueError("a variable is too large")
            inside = list(_elements(memoryview(unpacked), order))
        for one in inside:
            if one.kind == 14 and (named := _array(one.data, order)) is not None:  # miMATRIX
                found[named[0]] = named[1]
    return found


def _elements(data: memoryview, order: str) -> Iterator[_Element]:
    """Data elements in order. Raises ValueError if one exceeds the file."""
    at = 0
    while at + 8 <= len(data):
        kind, size = struct.unpack_from(f"{order}II", data, at)
        if kind >> 16:  # small format: type, size and up to four bytes in one
            kind, size = kind & 0xFFFF, kind >> 16
            start, after = at + 4, at + 8
        else:
            start = at + 8
            after = start + size + (-size % 8 if kind != 15 else 0)
        if start + size > len(data) or (start == at + 4 and size > 4):
            raise ValueError("a variable ends behind the file")
        yield _Element(kind, data[start : start + size])
        at = after


def _array(data: memoryview, order: str) -> tuple[str, Floats] | None:
    """Name and numbers of a matrix; None for text, cells, structures and sparse ones. Raises ValueError.

    Classes 6 to 15, mxDOUBLE_CLASS to mxUINT64_CLASS, are numbers.
    """
    inside = list(_elements(data, order))
    if len(inside) < 3 or len(inside[0].data) < 4:
        raise ValueError("a variable is damaged")
    flags, shape, name, *parts = inside
    if struct.unpack_from(f"{order}I", flags.data)[0] & 0xFF not in range(6, 16) or not parts:
        return None
    lengths = np.frombuffer(shape.data[: len(shape.data) // 4 * 4], f"{order}i4")
    size = np.dtype(_NUMBERS.get(parts[0].kind, "f8")).itemsize
    if parts[0].kind not in _NUMBERS or len(parts[0].data) % size:
        raise ValueError("a variable is damaged")
    values = np.frombuffer(parts[0].data, f"{order}{_NUMBERS[parts[0].kind]}").astype(float)
    if len(values) != int(np.prod(lengths.astype(float))):
        raise ValueError("a variable has other dimensions than numbers")
    return bytes(name.data).decode("latin-1"), values
