"""Text of the cutting force that a compensation assumes, and warnings where that assumption cannot hold.

Without a stock every feed move gets the force of the stated cut, or of a full slot: air moves and finishing passes
too. The step-over test looks for feed moves that run beside an earlier one of the same height by less than the tool's
diameter; there the tool meets less than a slot.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from camcomp.ground import path_geometry
from camcomp.ground.datatypes import RAPID, Bools, Floats, Ints, Path
from camcomp.ground.source_lines import named_lines
from camcomp.model.config.cutting_tool import Cutter
from camcomp.model.config.spec import Config
from camcomp.model.cutting.track import PLUNGE_SINE

Engagement = Literal["stock", "stated", "none"]
TWO_WAYS = "`workpiece: {stock: ...}` or `--stock program`"
LEVEL_MM = 1e-3  # of height: moves within it stay at one depth
MOST_SAMPLES = 20_000  # of a path in the step-over test
SAMPLE_DIAMETERS = 0.5  # distance of samples along the path, in tool diameters
STEP_OVER_DIAMETERS = (0.05, 0.9)  # distance of a neighbouring pass, in tool diameters: retraced paths are no step-over
MIN_STEP_OVER_SHARE = 0.1  # of the samples, from which a warning is given


@dataclass(frozen=True)
class AssumedForce:
    """The cutting force that a compensation assumes.

    engagement: `stock` by the stock, `stated` as the machine file writes it, `none`: it acts on every feed move.
    """

    model: str
    engagement: Engagement
    text: str


def assumed_force(config: Config) -> AssumedForce:
    """The force of a machine file in one line."""
    model, stock, process = config.process.force.model, config.workpiece.stock, config.process
    if model == "none":
        return AssumedForce(model, "none", "none; only what the machine file states of the machine is corrected")
    cut = _cut(config)
    if stock is not None:
        return AssumedForce(
            model, "stock", f"{model} model, where and how deep the tool meets the stock ({stock.type})"
        )
    if model == "table":
        return AssumedForce(model, "stated", "as measured along the path (force table)")
    top = config.workpiece.stock_top_mm
    if top is not None:
        return AssumedForce(model, "stated", f"{cut} on every feed move below Z {top:g} mm")
    where = "on every feed move but plunges, also in air and in finishing passes"
    stated = model != "constant" and process.width_mm is not None
    return AssumedForce(model, "stated" if stated else "none", f"{cut} {where}: no stock is stated ({TWO_WAYS})")


def _cut(config: Config) -> str:
    """Text of the stated cut, or of a constant force."""
    choice, process = config.process.force, config.process
    if choice.model == "constant":
        triple = ", ".join(f"{getattr(choice.params, key):g}" for key in ("Fr_N", "Ft_N", "Fz_N"))
        return f"constant {triple} N (Fr, Ft, Fz)"
    width = process.width_mm or config.tool.diameter_mm
    shape = "cut" if process.width_mm else "slot"
    sizes = [f"{each:g}" for each in (width, process.depth_mm) if each is not None]
    return f"{shape} of {' x '.join(sizes)} mm ({choice.model} model)" if sizes else f"{shape} ({choice.model} model)"


def _is_assumed(config: Config) -> bool:
    """Whether a force acts with an assumed engagement, known neither from a stock nor from a measurement."""
    return config.workpiece.stock is None and config.process.force.model not in ("none", "table")


def doubtful_force(config: Config, path: Path) -> list[str]:
    """Warnings where the assumed force cannot hold: drills, ball tools, step-overs below the diameter, rapids at depth.

    Empty where a stock gives the engagement or no force acts.
    """
    if not _is_assumed(config):
        return []
    doubts = ForceDoubts(config=config)
    doubts.add(path)
    out = doubts.warnings()
    on = np.flatnonzero((path.kind != RAPID) & path.known & ~path.machine)
    if share := _beside_share(path, on, doubts.cutters()):
        out.append(
            f"{100.0 * share:.0f} % of the feed path runs less than one tool diameter beside an earlier pass; "
            f"the assumed force is too large there; {TWO_WAYS}"
        )
    return out


@dataclass(eq=False, kw_only=True)
class ForceDoubts:
    """Tools of feed moves, and lateral rapids between cuts at their depth, found part by part of a path."""

    config: Config
    tools: set[int] = field(default_factory=set)
    lines: set[int] = field(default_factory=set)
    _flat: Bools = field(default_factory=lambda: np.zeros(0, np.bool_))  # of the last two motions, as the next ones
    _cuts: Bools = field(default_factory=lambda: np.zeros(0, np.bool_))
    _line: Ints = field(default_factory=lambda: np.zeros(0, np.int64))

    def add(self, path: Path) -> None:
        """Examine the next motions of a path; without effect if a stock is known or the force is zero."""
        if not _is_assumed(self.config):
            return
        known, way, top = path.known & ~path.machine, path.end - path.start, self.config.workpiece.stock_top_mm
        level = known & (np.abs(way[:, 2]) < LEVEL_MM) & (np.hypot(way[:, 0], way[:, 1]) > LEVEL_MM)
        cut = level & (path.kind != RAPID) & (True if top is None else path.end[:, 2] < top)
        flat = np.concatenate((self._flat, level & (path.kind == RAPID)))
        cuts, line = np.concatenate((self._cuts, cut)), np.concatenate((self._line, path.line))
        self.tools |= set(np.unique(path.tool[known & (path.kind != RAPID)]).tolist())
        self.lines |= set(line[1:-1][flat[1:-1] & cuts[:-2] & cuts[2:]].tolist())
        self._flat, self._cuts, self._line = flat[-2:], cuts[-2:], line[-2:]

    def cutters(self) -> list[Cutter]:
        """The tools of feed moves."""
        return [self.config.tools.get(number, self.config.tool) for number in sorted(self.tools)]

    def warnings(self) -> list[str]:
        """One warning per form of tool that is no flat mill, and one with the source lines of the rapids."""
        out = [
            f"the assumed force is that of a flat end mill, and the tool is a {kind}; {TWO_WAYS}"
            for kind in sorted({str(each.type) for each in self.cutters()} & {"ball", "drill"})
        ]
        if not self.lines:
            return out
        where = f"G0 at cutting depth between two cuts at {named_lines(sorted(self.lines))}"
        return [
            *out,
            f"{where}: the model has no force there, and the machine may cut at rapid speed; retract, or state the stock",
        ]


def _beside_share(path: Path, on: Ints, cutters: Sequence[Cutter]) -> float:
    """Share of the lateral feed path (motions `on`) next to an earlier pass of the same height; 0 below MIN_BESIDE_SHARE."""
    diameter = min((each.diameter_mm for each in cutters if each.diameter_mm), default=None)
    if diameter is None or not len(on):
        return 0.0
    point, along = _samples(path, on, SAMPLE_DIAMETERS * diameter)
    if len(point) < 2:
        return 0.0
    from scipy.spatial import cKDTree  # not needed by most runs, and slow to import

    near, far = (share * diameter for share in STEP_OVER_DIAMETERS)
    scaled = point * [1.0, 1.0, 20.0]  # passes of other heights are no neighbours
    pairs = cKDTree(scaled).query_pairs(far, output_type="ndarray")
    apart = np.linalg.norm(scaled[pairs[:, 0]] - scaled[pairs[:, 1]], axis=1)
    way = np.abs(along[pairs[:, 0]] - along[pairs[:, 1]])
    beside = np.unique(pairs[(apart > near) & (way > 3.0 * diameter)].max(axis=1)) if len(pairs) else np.zeros(0)
    share = len(beside) / len(point)
    return share if share > MIN_STEP_OVER_SHARE else 0.0


def _samples(path: Path, on: Ints, step: float) -> tuple[Floats, Floats]:
    """Points (k, 3) mm along the lateral ones of motions `on`, and the path length (k,) mm up to each."""
    length = path_geometry.lengths(path)[on]
    rise = np.abs(path.end[on, 2] - path.start[on, 2])
    lateral = (length > 0.0) & (rise < 0.5 * length) & (rise < (1.0 - PLUNGE_SINE) * np.maximum(length, 1e-12))
    on, length = on[lateral], length[lateral]
    total = float(length.sum())
    if not total > 0.0:
        return np.zeros((0, 3)), np.zeros(0)
    at = np.arange(0.5 * step, total, max(step, total / MOST_SAMPLES))
    ends = np.cumsum(length)
    which = np.searchsorted(ends, at)
    which = np.minimum(which, len(on) - 1)
    u = (at - (ends[which] - length[which])) / length[which]
    return path_geometry.points(path, on[which], np.clip(u, 0.0, 1.0)), at
