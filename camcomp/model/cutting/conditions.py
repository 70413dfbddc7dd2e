"""Cutting conditions of the averaged models, taken from a Cut, with errors that name the key to add."""

from typing import Literal

import numpy as np

from camcomp.ground.datatypes import Bools, Floats
from camcomp.ground.errors import ConfigError
from camcomp.ground.records import replace
from camcomp.model.cutting.cut import Cut
from camcomp.model.cutting.engaged import EngagementArcs
from camcomp.model.cutting.engagement import Milling, immersion
from camcomp.model.cutting.frame import lateral


def _refuse(rule: str, bad: Bools, cut: Cut, message: str) -> None:
    if bad.any():
        raise ConfigError(rule, f"program line {int(cut.line[int(np.argmax(bad))])}: {message}")


def feed_per_tooth(cut: Cut) -> Floats:
    """Feed per tooth (n,) in mm: the part of the feed across the tool axis over teeth and spindle speed.

    Raises ConfigError CC250 (spindle speed), CC251 (teeth), CC252 (feed).
    """
    if not cut.teeth or cut.teeth < 1:
        raise ConfigError("CC251", "the number of teeth of the tool is not known")
    _refuse("CC250", ~(np.abs(cut.speed) > 0), cut, "the tool cuts, but the spindle speed is zero or not known")
    _refuse("CC252", ~(cut.feed > 0), cut, "the tool cuts, but the feed is zero or not known")
    out: Floats = cut.feed * lateral(cut.tangent, cut.tool_axis) / (cut.teeth * np.abs(cut.speed))
    return out


def axial_depth(cut: Cut) -> Floats:
    """Axial depth (n,) in mm, zero above the stock. Raises ConfigError CC253 where it is not known."""
    _refuse("CC253", np.isnan(cut.depth), cut, "the axial depth of the cut is not known")
    return np.maximum(cut.depth, 0.0)


def clockwise(cut: Cut, stated: Literal["clockwise", "counterclockwise"] | None) -> Bools:
    """Whether the spindle turns clockwise (n,): as the program says, else as stated, else clockwise.

    Raises ConfigError CC258 where the program turns it the other way than stated.
    """
    if stated is None:
        return ~(cut.turn < 0.0)
    sense = 1.0 if stated == "clockwise" else -1.0
    message = (
        f"the program turns the spindle with {'M4' if sense > 0.0 else 'M3'}, process: force: spindle says {stated}"
    )
    _refuse("CC258", cut.turn == -sense, cut, message)
    return np.full(len(cut), sense > 0.0)


def engagement(cut: Cut, milling: Milling | None) -> tuple[Floats, Floats]:
    """Entry and exit angle (n,) in rad; an unknown width is a slot and needs neither diameter nor milling direction.

    Raises ConfigError CC254 (diameter), CC255 (width not between 0 and the diameter), CC256 (up or down not stated).
    """
    given = ~np.isnan(cut.width)
    if not given.any():
        return np.zeros(len(cut)), np.full(len(cut), np.pi)
    if cut.diameter_mm is None or not cut.diameter_mm > 0:
        raise ConfigError("CC254", "a radial width is given, but the tool diameter is not")
    d = cut.diameter_mm
    wrong = given & ~((cut.width > 0) & (cut.width <= d))
    if wrong.any():
        width = cut.width[int(np.argmax(wrong))]
        _refuse("CC255", wrong, cut, f"a radial width of {width:g} mm is not possible with a tool of {d:g} mm")
    if milling is None:
        _refuse("CC256", given & (cut.width < d), cut, "the tool cuts on one side, and up or down milling is not said")
    return immersion(cut.width, d, milling or "up")


def engagement_arcs(cut: Cut, milling: Milling | None, clockwise: Bools) -> EngagementArcs:
    """Engagement arcs in the direction of rotation: of the stock, or one per point from width and depth.

    Raises the errors of `axial_depth` and `engagement` if the stock is unknown.
    """
    if cut.arcs is not None:
        start, stop = cut.arcs.turned(clockwise)
        return replace(cut.arcs, start=start, stop=stop)
    start, stop = engagement(cut, milling)
    n = len(cut)
    return EngagementArcs(
        place=np.arange(n), start=start, stop=stop, height=axial_depth(cut), rise=np.ones(n), run=np.zeros(n)
    )
