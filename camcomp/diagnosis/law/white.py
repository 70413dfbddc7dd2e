"""Columns of a law in white rows."""

from __future__ import annotations

from dataclasses import dataclass

from camcomp.ground.datatypes import Floats, Ints


@dataclass(frozen=True, eq=False)
class White:
    """Per run: which white rows a spot reaches (r,), and columns (r, k) there."""

    rows: tuple[Ints, ...]
    columns: tuple[Floats, ...]
