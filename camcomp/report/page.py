"""A report as one self-contained HTML file with style, script, plot library and data.

It contains no time, user or folder, so that equal inputs give equal bytes.
"""

from __future__ import annotations

import base64
import gzip
import json
import re
from collections.abc import Sequence
from functools import cache
from html import escape
from importlib.resources import files
from itertools import zip_longest

from camcomp import __version__
from camcomp.ground.errors import ConfigError
from camcomp.ground.records import dataclass, field
from camcomp.report.plot import Figure

# The browser enforces that scripts and styles come from this file only.
_POLICY = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:"

_UNIT = re.compile(r"(\d) (µm|mm|mrad|rad|N·m|N|s|times)\b")  # number and unit stay on one line


WORDY, PROSE = 24, 90  # characters from which a cell of text gets a medium and a large width


@dataclass(frozen=True)
class Table:
    """A table with heads; cells are texts, or numbers as (value to sort by, text to show)."""

    caption: str
    heads: Sequence[str]
    rows: Sequence[Sequence[str | tuple[float, str]]]
    sortable: bool = False


@dataclass(frozen=True)
class Listing:
    """A text file that the reader can view and save."""

    name: str
    text: str


@dataclass(frozen=True, kw_only=True)
class Section:
    """A headed part of a page; `text` are paragraphs of plain text."""

    name: str
    title: str
    text: Sequence[str] = ()
    figures: Sequence[Figure] = ()
    tables: Sequence[Table] = ()
    items: Sequence[str] = ()  # a bulleted list
    listings: Sequence[Listing] = ()


@dataclass(frozen=True, kw_only=True)
class Page:
    """A report. verdict: its conclusion in one line; good: passed; cards: (quantity, value, remark)."""

    title: str
    subtitle: str
    verdict: str
    good: bool
    cards: Sequence[tuple[str, str, str]]
    sections: Sequence[Section] = field(default_factory=tuple)
    word: str = ""  # before the verdict; default Passed or Attention
    caution: str = ""  # a reservation behind the verdict, which then has no colour of a pass


@cache
def plot_library() -> str:
    """The plot library as base64 of gzip. Raises ConfigError CC216 without plotly."""
    try:
        from plotly.offline import get_plotlyjs
    except ImportError as error:
        raise ConfigError("CC216", "a report needs the package plotly, which is not installed") from error
    return base64.b64encode(gzip.compress(get_plotlyjs().encode(), compresslevel=9, mtime=0)).decode()


def render(page: Page) -> bytes:
    """The page as UTF-8 HTML."""
    figures = [each.as_json() for section in page.sections for each in section.figures]
    data = json.dumps(figures, separators=(",", ":"), ensure_ascii=False, allow_nan=False).replace("<", "\\u003c")
    head = [
        "<!doctype html>",
        '<html lang="en">',
        '<head><meta charset="utf-8">',
        f'<meta http-equiv="Content-Security-Policy" content="{_POLICY}">',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        f'<meta name="generator" content="camcomp {__version__}">',
        f"<title>{escape(page.title)}</title>",
        f"<style>{_asset('page.css')}</style></head>",
    ]
    links = "".join(f'<li><a href="#{s.name}">{escape(s.title)}</a></li>' for s in page.sections)
    kind, word = ("good", "Passed") if page.good else ("bad", "Attention")
    if page.good and page.caution:
        kind, word = "caution", "Passed by the model"
    word = page.word or word
    verdict = f"{page.verdict} {page.caution}".rstrip()
    body = [
        '<body><a class="skip" href="#main">Skip to the report</a>',
        '<header><div class="bar"><p class="brand">camcomp</p>',
        '<button type="button" id="theme">Dark colours</button></div>',
        f'<h1>{escape(page.title)}</h1><p class="subtitle">{escape(page.subtitle)}</p>',
        f'<p class="verdict {kind}"><strong>{escape(word)}.</strong> {escape(verdict)}</p>',
        '<dl class="cards">',
        *(
            f"<div><dt>{escape(what)}</dt><dd>{escape(value)}<small>{escape(remark)}</small></dd></div>"
            for what, value, remark in page.cards
        ),
        f'</dl><nav aria-label="Sections"><ul>{links}</ul></nav></header>',
        '<noscript><p class="note">The plots need JavaScript; the tables do not.</p></noscript>',
        '<main id="main">',
        *(_section(each) for each in page.sections),
        f"</main><footer><p>Written by camcomp {__version__}. The same inputs give the same file.</p></footer>",
    ]
    scripts = [
        f'<script type="application/json" id="figures">{data}</script>',
        f'<script type="text/plain" id="library">{plot_library() if figures else ""}</script>',
        f"<script>{_asset('page.js')}</script></body></html>",
    ]
    return "\n".join([*head, *(_UNIT.sub("\\1\u00a0\\2", each) for each in body), *scripts, ""]).encode(
        "utf-8", "backslashreplace"
    )


@cache
def _asset(name: str) -> str:
    return files("camcomp.report").joinpath("assets", name).read_text(encoding="utf-8")


def _section(section: Section) -> str:
    parts = [f'<section id="{section.name}" aria-labelledby="{section.name}-h">']
    parts.append(f'<h2 id="{section.name}-h">{escape(section.title)}</h2>')
    parts += [f"<p>{escape(text)}</p>" for text in section.text]
    if section.items:
        parts.append("<ul>" + "".join(f"<li>{escape(item)}</li>" for item in section.items) + "</ul>")
    parts += [_listing(each) for each in section.listings]
    parts += [_figure(each) for each in section.figures]
    parts += [_table(each) for each in section.tables]
    return "".join([*parts, "</section>"])


def _listing(listing: Listing) -> str:
    name = escape(listing.name, quote=True)
    data = base64.b64encode(listing.text.encode()).decode()
    return (
        f'<details><summary>{name}</summary><p><a download="{name}" href="data:text/plain;base64,{data}">Save {name}</a></p>'
        f'<pre tabindex="0">{escape(listing.text)}</pre></details>'
    )


def _figure(figure: Figure) -> str:
    name = figure.name
    controls = ""
    if figure.exaggerate:
        options = "".join(f"<option>{plane.upper()}</option>" for plane in figure.exaggerate["planes"])
        plane = f'<label for="{name}-p">Plane</label><select id="{name}-p">{options}</select>' if options else ""
        controls = (
            f'<div class="controls"><label for="{name}-k">Deviation enlarged</label>'
            f'<input type="range" id="{name}-k" min="0" max="100" step="1">'
            f'<output id="{name}-o" for="{name}-k"></output>{plane}</div>'
        )
    label = escape(f"{figure.title}: {figure.caption}", quote=True)
    return (
        f'<figure id="{name}"><h3>{escape(figure.title)}</h3>{controls}'
        f'<div class="plot" id="{name}-plot" role="img" aria-label="{label}" '
        f'style="height:{figure.height}px"></div><figcaption>{escape(figure.caption)}</figcaption></figure>'
    )


def _table(table: Table) -> str:
    kinds = [' class="n"' if isinstance(cell, tuple) else "" for cell in table.rows[0]] if table.rows else []
    if table.sortable:
        heads = "".join(
            f'<th scope="col"{kind} aria-sort="none"><button type="button">{escape(h)}</button></th>'
            for h, kind in zip(table.heads, kinds, strict=True)
        )
    else:
        heads = "".join(
            f'<th scope="col"{kind}>{escape(h)}</th>' for h, kind in zip_longest(table.heads, kinds, fillvalue="")
        )
    body = "".join(f"<tr>{''.join(_cell(c, i) for i, c in enumerate(row))}</tr>" for row in table.rows)
    kind = ' class="sortable"' if table.sortable else ""
    return (
        f'<div class="scroll" tabindex="0" role="region" aria-label="{escape(table.caption, quote=True)}">'
        f"<table{kind}><caption>{escape(table.caption)}</caption>"
        f"<thead><tr>{heads}</tr></thead><tbody>{body}</tbody></table></div>"
    )


def _cell(cell: str | tuple[float, str], column: int) -> str:
    if isinstance(cell, tuple):
        value, text = cell
        inside = f' class="n" data-v="{value:.9g}">{escape(text)}'
    else:
        kind = (
            "long"
            if len(cell) > 60 and " " not in cell
            else "prose"
            if len(cell) > PROSE
            else "text"
            if len(cell) > WORDY and " " in cell
            else ""
        )
        inside = f' class="{kind}">{escape(cell)}' if kind else f">{escape(cell)}"
    return f'<th scope="row"{inside}</th>' if column == 0 else f"<td{inside}</td>"
