"""The page of `camcomp place`: a map of the error over the table, a figure per turn, and the placements as a table."""

from __future__ import annotations

from collections.abc import Sequence

from camcomp.compensation.placing.search import Placement, PlacingResult
from camcomp.report.inputs import Input, inputs_section
from camcomp.report.page import Page, Section, Table, render
from camcomp.report.plot import SCALE, Figure, Json, axis, brief, micrometres

WHAT = {"band": "band after compensation (95 %)", "before": "largest error before compensation"}


def placing_page(result: PlacingResult, program: str, inputs: Sequence[Input]) -> bytes:
    """The page as HTML."""
    what, best, stated = WHAT[result.judged_by], result.best, result.stated
    if best is None:
        verdict = "The program can be cut at none of the places."
    else:
        verdict = f"{micrometres(best.judged_um or 0.0)} at {words(best)}; {_left(stated)} as stated."
    turns = list(dict.fromkeys(each.turn_deg for each in result.placements))
    figures = [_map(result, turn, what) for turn in turns]
    table = Table(
        "All placements", ("X mm", "Y mm", "turn deg", "posture", f"{what} µm", "why not"),
        [[_cell(e.x_mm), _cell(e.y_mm), _cell(e.turn_deg), e.posture, _cell(e.judged_um), e.why] for e in result.placements],
        sortable=True,
    )  # fmt: skip
    cards = [("Judged by", what, f"{result.motions[0]} of {result.motions[1]} motions"),
             ("As stated", _left(stated), words(stated))]  # fmt: skip
    sections = [
        Section(name="map", title="Map of the table", figures=figures),
        Section(name="all", title="Placements", tables=[table]),
    ]
    page = Page(
        title=f"Where to clamp {program}", subtitle="places of the program's zero in the machine frame", verdict=verdict,
        good=best is not None, cards=cards, sections=[*sections, inputs_section(inputs)], word="Best place" if best is not None else "",
    )  # fmt: skip
    return render(page)


def words(each: Placement) -> str:
    """A placement in one phrase."""
    posture = "" if each.posture == "stated" else f", {each.posture}"
    return f"X{each.x_mm:.0f} Y{each.y_mm:.0f} mm, turned by {each.turn_deg:g}°{posture}"


def _left(each: Placement) -> str:
    return micrometres(each.judged_um) if each.judged_um is not None else f"not possible ({each.why})"


def _cell(value: float | None) -> str | tuple[float, str]:
    return (value, brief(value, 4)) if value is not None else ""


def _map(result: PlacingResult, turn: float, what: str) -> Figure:
    """Placements of one turn as markers, coloured by their error; crosses where the program cannot be cut."""
    here = [each for each in result.placements if each.turn_deg == turn]
    worst_first = sorted((e for e in here if e.judged_um is not None), key=lambda each: -(each.judged_um or 0.0))
    good = list({(each.x_mm, each.y_mm): each for each in worst_first}.values())  # the best posture of each place
    cut = {(each.x_mm, each.y_mm) for each in good}
    bad = [each for each in here if (each.x_mm, each.y_mm) not in cut]
    marker: Json = {"size": 18, "symbol": "square", "color": [e.judged_um for e in good], "colorscale": SCALE,
                    "showscale": True, "colorbar": {"title": {"text": "µm"}}}  # fmt: skip
    traces: list[Json] = [
        _markers(what, good, marker, "X %{x} mm, Y %{y} mm: %{marker.color:.4g} µm"),
        _markers("not possible", bad, {"size": 10, "symbol": "x-thin-open"}, "X %{x} mm, Y %{y} mm"),
    ]
    if result.best is not None and result.best.turn_deg == turn:
        traces.append(
            _markers("best", [result.best], {"size": 24, "symbol": "circle-open", "line": {"width": 3}}, "best")
        )
    return Figure(
        name=f"map{turn:g}", title=f"Turned by {turn:g}°", traces=traces, height=460,
        caption=f"{what} by the place of the program's zero: {len(good)} places, {len(bad)} where the program cannot be cut.",
        layout={"legend": {"orientation": "h", "y": 1.12}, "xaxis": axis("X of the zero, mm"), "yaxis": axis("Y of the zero, mm", scaleanchor="x")},
    )  # fmt: skip


def _markers(name: str, places: Sequence[Placement], marker: Json, hover: str) -> Json:
    return {"type": "scatter", "mode": "markers", "name": name, "x": [e.x_mm for e in places], "y": [e.y_mm for e in places],
            "marker": marker, "hovertemplate": hover + "<extra></extra>"}  # fmt: skip
