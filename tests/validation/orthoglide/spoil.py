"""Ways in which a good experiment is spoilt on its way to the tool.  Each changes files of a folder in place."""

from __future__ import annotations

import csv
from collections.abc import Callable
from pathlib import Path

Rows = list[dict[str, str]]


def _edit(path: Path, change: Callable[[Rows], Rows]) -> None:
    with path.open(newline="") as source:
        rows = list(csv.DictReader(source))
    names = list(rows[0])
    rows = change(rows)
    with path.open("w", newline="") as out:
        writer = csv.DictWriter(out, names, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def _logs(folder: Path) -> list[Path]:
    return sorted(folder.glob("log-*.csv"))


def _scaled(row: dict[str, str], names: tuple[str, ...], factor: float) -> dict[str, str]:
    return row | {n: f"{float(row[n]) * factor:.7f}" for n in names if row[n]}


TIP = ("x_mm", "y_mm", "z_mm")


def metres(folder: Path) -> None:
    """The tracker wrote metres under a header that says millimetres."""
    for path in _logs(folder):
        _edit(path, lambda rows: [_scaled(r, TIP, 1e-3) for r in rows])


def inches(folder: Path) -> None:
    """The tracker wrote inches."""
    for path in _logs(folder):
        _edit(path, lambda rows: [_scaled(r, TIP, 1 / 25.4) for r in rows])


def swapped(folder: Path) -> None:
    """x and y of the tracker exchanged."""
    for path in _logs(folder):
        _edit(path, lambda rows: [r | {"x_mm": r["y_mm"], "y_mm": r["x_mm"]} for r in rows])


def gaps(folder: Path) -> None:
    """A fifth of every log is missing, and every seventh cell of the tip."""

    def change(rows: Rows) -> Rows:
        kept = [r for i, r in enumerate(rows) if not len(rows) * 0.4 < i < len(rows) * 0.6]
        return [r | dict.fromkeys(TIP, "") if i % 7 == 3 else r for i, r in enumerate(kept)]

    for path in _logs(folder):
        _edit(path, change)


def drifting(folder: Path) -> None:
    """The logger's clock gains a thousandth."""
    for path in _logs(folder):
        _edit(path, lambda rows: [_scaled(r, ("t_s",), 1.001) for r in rows])


def exchanged(folder: Path) -> None:
    """The logs of the first two runs stand under each other's programs."""
    first, second = _logs(folder)[:2]
    a, b = first.read_bytes(), second.read_bytes()
    first.write_bytes(b)
    second.write_bytes(a)
