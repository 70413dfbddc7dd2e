"""Section of the report on the law of an unknown effect: formula, its plot over the residuals, remaining gap."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from camcomp.diagnosis.report.answer import law_lines
from camcomp.diagnosis.report.words import cell, shortened
from camcomp.diagnosis.result.types import Law
from camcomp.ground.datatypes import Floats
from camcomp.report.page import Section, Table
from camcomp.report.plot import STYLES, Figure, Json, axis, brief, numbers, thin


@dataclass(frozen=True, eq=False)
class LawView:
    """Residuals explained by a law.

    covariate: name; axis: of the tip; runs: per run its name, covariate (n,), residual without the law (n,) um, and cross-
    validated prediction of the law (n,) um; sizes: rms of the gap (runs, 2) um without and with it.
    """

    covariate: str
    axis: str
    runs: tuple[tuple[str, Floats, Floats, Floats], ...]
    sizes: Floats


def law_section(law: Law, view: LawView | None) -> Section:
    """The section of a page."""
    text = law_lines(law)
    text.append(
        "It changes nothing in the verdict. camcomp diagnose --write-config writes it into the machine file, where "
        "simulate, compensate, verify and stream use it within the bounds in which it was seen."
    )
    if view is None:
        return Section(name="law", title="The law of what is left", text=text)
    rows: list[list[str | tuple[float, str]]] = [
        [name, cell(before), cell(after)] for (name, *_), (before, after) in zip(view.runs, view.sizes, strict=True)
    ]
    table = Table(
        "Gap of every run without and with the law, which was fitted to the others",
        ("run", "rms µm", "with the law"),
        rows,
    )
    return Section(name="law", title="The law of what is left", text=text, figures=[_figure(law, view)], tables=[table])


def _figure(law: Law, view: LawView) -> Figure:
    x, left, said = (np.concatenate([run[k] for run in view.runs]) for k in (1, 2, 3))
    known = np.isfinite(left)
    x, left, said = x[known], left[known], said[known]
    index = thin(np.column_stack((left, said)))
    traces: list[Json] = [
        _dots("left without the law", x[index], left[index], STYLES[0][0], 4),
        _dots("the law, fitted to the other runs", x[index], said[index], STYLES[1][0], 5),
    ]
    words = f"from {brief(law.before_rms_um)} µm to {brief(law.after_rms_um)} µm rms"
    return Figure(
        name="law",
        title=f"What is left of tip {view.axis} over {view.covariate}",
        caption=f"Every row of all runs: what the known causes leave, and {shortened(law.formula)}. On runs that it was not fitted to it takes the "
        f"gap {words}.",
        traces=traces,
        layout={"xaxis": axis(view.covariate), "yaxis": axis("µm")},
    )


def _dots(name: str, x: Floats, y: Floats, color: str, size: int) -> Json:
    return {
        "type": "scatter", "mode": "markers", "name": name, "x": numbers(x, 4), "y": numbers(y, 2),
        "marker": {"color": color, "size": size},
    }  # fmt: skip
