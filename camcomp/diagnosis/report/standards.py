"""Section of a report on acceptance tests, ISO 230-2 and ISO 9283, with reasons for missing values."""

from __future__ import annotations

from camcomp.diagnosis.report.words import cell
from camcomp.diagnosis.result.standards import StandardValues
from camcomp.report.page import Section, Table

_SHOWN = ("A", "A_forward", "A_backward", "R", "R_forward", "R_backward", "B", "E", "M")
_ISO_230_2 = (
    "ISO 230-2: accuracy A, repeatability R, reversal error B, systematic deviation E and range of the means M of positioning "
    "without load; deviations are measured minus commanded tip along the axis, forward means with rising coordinate."
)
_ISO_9283 = (
    "ISO 9283: pose accuracy AP and pose repeatability RP. Commanded is the nominal arm at its encoders, in the frame and with the "
    "tool vector that fit best, so AP leaves out what these two can take up."
)


def standards_section(values: StandardValues) -> Section | None:
    """The section; None for results of earlier versions without such values."""
    tables, text = [], []
    if values.positioning:
        rows: list[list[str | tuple[float, str]]] = [
            [
                each.axis, each.line, f"{each.targets} x {each.approaches}",
                *(cell(getattr(each, f"{name}_um")) for name in _SHOWN),
            ]
            for each in values.positioning
        ]  # fmt: skip
        heads = ("axis", "line", "targets x approaches", *(f"{name.replace('_', ' ')} µm" for name in _SHOWN))
        tables.append(Table("Positioning", heads, rows))
        text.append(_ISO_230_2)
    if values.poses:
        poses: list[list[str | tuple[float, str]]] = [
            [each.campaign, each.pose, str(each.visits), cell(each.AP_um), cell(each.RP_um)] for each in values.poses
        ]
        tables.append(Table("Poses", ("campaign", "joints", "visits", "AP µm", "RP µm"), poses))
        text.append(_ISO_9283)
    if not text and not values.absent:
        return None
    items = [f"Absent: {each}." for each in values.absent]
    return Section(name="standards", title="Values by standards", text=text, tables=tables, items=items)
