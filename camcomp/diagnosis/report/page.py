"""The HTML report of a diagnosis, with the evidence for every cause."""

from __future__ import annotations

from collections.abc import Sequence

from camcomp.diagnosis.law.words import listed
from camcomp.diagnosis.report.answer import by_share, floor_text, verdict_text
from camcomp.diagnosis.report.circles import circles_section
from camcomp.diagnosis.report.figures import (
    figure_ladder,
    figure_map,
    figure_shares,
    figure_signed,
    figure_size,
)
from camcomp.diagnosis.report.joints import joints_section
from camcomp.diagnosis.report.law_section import LawView, law_section
from camcomp.diagnosis.report.run_view import MOST_DRAWN, RunView, rms
from camcomp.diagnosis.report.standards import standards_section
from camcomp.diagnosis.report.words import cell, percent, plain, remedy, sizes
from camcomp.diagnosis.result.types import UNKNOWN, DiagnosisResult, NextExperiment, UnseenShrinkage, Where
from camcomp.report.inputs import Input, inputs_section
from camcomp.report.page import Listing, Page, Section, Table, render
from camcomp.report.plot import brief, micrometres

Row = list[str | tuple[float, str]]  # of a table: text, or a number to sort by and its text
INDISTINGUISHABLE_TEXT = (
    "Each of these sets explains the logs as well as the others. They stay together because, in the runs that were made, "
    "they do the same to what was measured: the same columns, the same places, the same times."
)
NO_ACTION = "Nothing: machine and model agree as far as these runs can tell."
WAIT = "Repair nothing yet: these runs cannot tell which of the causes it is. The next experiment below is made to decide it."
COMPENSATE = (
    "What stays after a repair can be compensated: camcomp diagnose --write-config writes the machine file with these causes "
    "in it, and compensate then takes them out of every program."
)
ADD_IT = "Add its log to the experiment file as one more run, and diagnose again."
PUT_IN = "camcomp diagnose --write-config writes the law into the machine file, and compensate then takes it out of every program."
LOOK = "Part of the gap is none of the effects that camcomp knows; below stands where it shows and what it goes with."
WORDS = {"none": "No gap", "identified": "Identified", "ambiguous": "Ambiguous", "unknown": "Unknown cause"}


def diagnosis_html(
    result: DiagnosisResult,
    views: Sequence[RunView],
    *,
    title: str,
    machine: str,
    inputs: Sequence[Input] = (),
    notes: Sequence[str] = (),
    next_program: Listing | None = None,
    law: LawView | None = None,
) -> bytes:
    """One HTML file. result: of any kind of study; views: runs to draw, withheld ones first.

    next_program: file of the proposed experiment. law: residuals explained by the law of an unknown effect.
    Raises ConfigError CC216 without the plot library.
    """
    seen = [view for view in views if view.held_out] or list(views)
    seen = sorted(seen, key=lambda view: -rms(view.sizes[0]))
    floor = result.gap.noise_floor_um
    sections = [
        Section(name="notes", title="Notes", items=notes) if notes else None,
        _to_do(result, next_program),
        circles_section(views, result.standards.circles),
        None if result.law is None else law_section(result.law, law),
        _apart(result) if len(result.alternatives) > 1 else None,
        _shrinkage(result.shrinkage, floor) if result.shrinkage and result.shrinkage.steps else None,
        joints_section(result),
        *_gap_of_runs(seen, floor),
        _where(result.where),
        standards_section(result.standards),
        inputs_section(inputs) if inputs else None,
    ]
    page = Page(
        title=title,
        subtitle=f"Diagnosis of the gap between {machine} and its model",
        verdict=verdict_text(result),
        good=result.verdict in ("none", "identified"),
        cards=_cards(result),
        sections=[each for each in sections if each is not None],
        word=WORDS[result.verdict],
    )
    return render(page)


def _gap_of_runs(views: Sequence[RunView], floor: float | None) -> list[Section]:
    """Sections of the gap along time, path and workpiece; views: runs, the one with the largest gap first."""
    if not views:
        return []
    shown = views[:MOST_DRAWN]
    left_out = len(views) - len(shown)
    text = [f"The {len(shown)} runs with the largest gap; {left_out} more are not drawn."] if left_out else []
    along_time = [figure_signed(v, i) for i, v in enumerate(shown, 1)]
    along_path = [figure_size(v, i, floor) for i, v in enumerate(shown, 1)]
    return [
        Section(name="time", title="Gap along the time", text=text, figures=along_time),
        Section(name="path", title="Gap along the path", text=text, figures=along_path),
        Section(name="map", title="On the workpiece", figures=[figure_map(views)]),
    ]


def _cards(result: DiagnosisResult) -> list[tuple[str, str, str]]:
    gap = result.gap
    cards = [
        ("Gap", micrometres(gap.rms_um), f"rms; 95 % below {micrometres(gap.p95_um)}, max {micrometres(gap.max_um)}"),
        ("Noise floor", floor_text(gap), "what no model can explain"),
    ]
    if (law := result.law) is not None and not result.known:
        share = 1.0 - law.after_rms_um / law.before_rms_um if law.before_rms_um > 0.0 else 0.0
        cards += [
            ("Gap with the law found", micrometres(law.after_rms_um), f"was {micrometres(law.before_rms_um)}"),
            ("Part of the gap removed", f"{100 * share:.1f} %", "by the law, on parts that it was not fitted to"),
        ]
    elif shrink := result.shrinkage:
        low, high = shrink.ci95
        interval = f"95 % interval {100 * low:.1f} to {100 * high:.1f} %"
        cards += [
            ("Gap on unseen runs", micrometres(shrink.after_rms_um), f"was {micrometres(shrink.before_rms_um)}"),
            ("Part of the gap removed", f"{100 * shrink.ratio:.1f} %", interval),
        ]
    return [*cards, ("Stage", result.where.stage, "where in the machine")]


def _apart(result: DiagnosisResult) -> Section:
    items = [listed([each.label for each in one]) for one in result.alternatives]
    return Section(name="apart", title="What cannot be told apart, and why", text=[INDISTINGUISHABLE_TEXT], items=items)


def _shrinkage(shrink: UnseenShrinkage, floor: float | None) -> Section:
    low, high = shrink.ci95
    text = (
        f"Judged on {listed(shrink.holdout)}, with causes fitted without what is judged. {100 * shrink.ratio:.1f} % of the "
        f"gap goes (95 % interval {100 * low:.1f} to {100 * high:.1f} %)."
    )
    ladder = figure_ladder(shrink, floor)
    return Section(name="shrinkage", title="How far the gap shrinks", text=[text], figures=[ladder])


def _to_do(result: DiagnosisResult, next_program: Listing | None) -> Section:
    """Section with every cause and its remedy, and the next experiment."""
    unknown = [each for each in result.causes if each.effect == UNKNOWN]
    rows: list[Row] = []
    for cause in (*by_share(result), *unknown):
        name, probability = f"{cause.label}: {plain(cause)}", f"{100 * cause.probability:.1f} %"
        rows.append([name, sizes(cause), probability, percent(cause.share), remedy(cause)])
    heads = ("cause", "size with its 95 % interval", "probability", "share of the gap", "what to do")
    tables = [Table("Causes and what helps", heads, rows)] if rows else []
    text = [NO_ACTION] if result.verdict == "none" else []
    if result.verdict == "ambiguous":
        text.append(WAIT)
    elif result.known:
        text.append(COMPENSATE)
    if unknown:
        text.append(LOOK)
    if result.law is not None:
        text.append(f"{result.law.says} {PUT_IN}")
    listings = []
    if result.next_experiment:
        text += _next(result.next_experiment)
        if next_program is not None:
            listings.append(Listing(next_program.name, next_program.text))
    items = result.next_experiment.outcomes if result.next_experiment else ()
    return Section(name="do", title="What to do", text=text, tables=tables, items=items, listings=listings)


def _next(proposal: NextExperiment) -> list[str]:
    """Text of the next experiment and its expected gain; its outcomes follow as a list."""
    time = f", {brief(proposal.minutes, 2)} minutes with setting up" if proposal.minutes else ""
    gain = f"{brief(proposal.gain)} bits expected{time}."
    if proposal.moves is not None:
        gain = f"It tells whether anything is left, and what that goes with: {gain}"
    elif UNKNOWN in proposal.separates and proposal.poses is None:
        gain = f"It changes what the unknown effect may depend on, and as little else as can be: {gain}"
    elif separates := listed(proposal.separates):
        gain = f"It separates {separates}: {gain}"
    return [f"Measure next: {proposal.action.rstrip('.')}.", f"{gain} {ADD_IT}"]


def _where(where: Where) -> Section:
    def part(share: float) -> tuple[float, str]:
        return share, f"{100 * share:.1f} %"

    lines: list[Row] = [[e.run, (float(e.line), str(e.line)), part(e.share), cell(e.rms_um)] for e in where.lines]
    times: list[Row] = [[e.run, cell(e.t0_s), cell(e.t1_s), part(e.share)] for e in where.intervals]
    shaken: list[Row] = [[e.axis, cell(e.hertz), cell(e.amplitude_um), part(e.share)] for e in where.frequencies]
    tables = [
        Table(title, heads, rows, sortable=True)
        for title, heads, rows in (
            ("Source lines with most of the gap", ("run", "line", "share", "rms µm"), lines),
            ("Times with most of the gap", ("run", "from s", "to s", "share"), times),
            ("Vibrations", ("axis", "frequency Hz", "amplitude µm", "share"), shaken),
        )
        if rows
    ]
    text = [f"The gap arises in the stage: {where.stage}."]
    figures = [figure for figure in (figure_shares(where),) if figure]
    return Section(name="where", title="Where the gap is", text=text, figures=figures, tables=tables)
