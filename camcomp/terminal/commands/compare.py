"""camcomp compare."""

from collections.abc import Sequence
from math import isnan
from typing import TYPE_CHECKING

import click

from camcomp.ground.errors import CheckFailed, ConfigError
from camcomp.ground.files import write_all
from camcomp.ground.places import STANDARD
from camcomp.terminal.commands._options import OUTPUT

if TYPE_CHECKING:
    from camcomp.api.comparison import Comparison, Difference


@click.command()
@click.argument("a", metavar="A.csv")
@click.argument("b", metavar="B.csv")
@click.option(
    "--by", type=click.Choice(["s", "t", "row"]), help="Align by path length, time or row; default: what fits."
)
@click.option("--column", "columns", metavar="NAME", multiple=True, help="Only this column; repeatable.")
@click.option("--json", "json_file", metavar="OUT.json", type=OUTPUT, help="The figures as JSON.")
@click.option(
    "--tolerance", "tolerances", metavar="[NAME=]VALUE", multiple=True,
    help="Exit with 1 when a column (without NAME: any) differs by more, in its own unit; repeatable.",
)  # fmt: skip
def command(
    a: str, b: str, by: str | None, columns: tuple[str, ...], json_file: str | None, tolerances: tuple[str, ...]
) -> None:
    """Compare two logs or joint tables of one program.

    Tells for every column the largest difference and where it is, its root mean square and its mean (A minus B). Rows
    are aligned by source line and path length, or by time; B is interpolated between its rows.
    """
    from camcomp.api.comparison import compare

    limits = [_limit(each) for each in tolerances]
    done = compare(a, b, by)
    known = [each.column for each in done.differences]
    for name in (*columns, *(name for name, _ in limits if name)):
        if name not in known:
            raise ConfigError("CC451", f"no column {name} in both tables", hint=f"there are {', '.join(known)}")
    shown = [each for each in done.differences if not columns or each.column in columns]
    if json_file:
        write_all({json_file: done.to_json()}, inputs=(a, b))
    if json_file != STANDARD:
        click.echo("\n".join(_text(done, shown)))
    over = [
        f"{each.column} differs by {each.most:.6g}, more than {limit:g}"
        for name, limit in limits
        for each in done.differences
        if (each.column == name or (not name and each in shown)) and each.most > limit
    ]
    if over:
        raise CheckFailed("CC606", "; ".join(dict.fromkeys(over)))


def _limit(text: str) -> tuple[str, float]:
    name, _, value = text.rpartition("=")
    try:
        return name, float(value)
    except ValueError:
        raise click.BadParameter(f"'{value}' is not a number", param_hint="--tolerance") from None


def _text(done: "Comparison", shown: "Sequence[Difference]") -> list[str]:
    place = {"s_mm": "at s mm", "t_s": "at t s", "row": "at row"}[done.by]
    heads = ("column", "rows", "max", "rms", "mean", "line", place, "A", "B")
    cells = [
        (d.column, str(d.rows), *(f"{v:.6g}" for v in (d.most, d.rms, d.mean)), "" if d.line is None else str(d.line),
         *("" if isnan(v) else f"{v:.7g}" for v in (d.place, d.a, d.b)))
        for d in shown
    ]  # fmt: skip
    widths = [max(len(row[i]) for row in (heads, *cells)) for i in range(len(heads))]
    out = [
        "  ".join(
            cell.ljust(w) if i == 0 else cell.rjust(w) for i, (cell, w) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in (heads, *cells)
    ]
    rows = f"{done.rows} rows of A, aligned by {done.by}: {done.interpolated} between two rows of B"
    out.append(rows + f", {done.unmatched} without a counterpart")
    for name, only in (("A", done.only_a), ("B", done.only_b)):
        if only:
            out.append(f"only in {name}: {', '.join(only)}")
    return out
