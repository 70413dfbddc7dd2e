"""Text of the cutting force that a compensation assumes, and warnings where that assumption cannot hold.

Without a stock every feed move gets the force of the stated cut, or of a full slot: air moves and finishing passes
too. The step-over test looks for feed moves that run beside an earlier one of the same height by less than the tool's
diameter; there the tool meets less than a slot.
"""

from __future__ import annotations

from typing import Literal

import numpy as np

from camcomp.ground import path_geometry
from camcomp.ground.datatypes import RAPID, Bools, Floats, Ints, Path
from camcomp.ground.records import dataclass, field
from camcomp.ground.source_lines import named_lines
from camcomp.ground.vectors import distinct, sizes
from camcomp.model.config.cutting_tool import Cutter
from camcomp.model.config.spec import Config
from camcomp.model.cutting.track import PLUNGE_SINE

Engagement = Literal["stock", "stated", "none"]
TWO_WAYS = "`workpiece: {stock: ...}` or `--stock program`"
LEVEL_MM = 1e-3  # of height: moves within it stay at one depth
MOST_SAMPLES = 20_000  # that the step-over test keeps
MOST_AT_ONCE = 1_000_000  # samples of one part of a path
LEVEL_STRETCH = 20.0  # passes of other heights are no neighbours
TILE_DIAMETERS = 8.0  # edge of a tile of space, in diameters of the first tool
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


@dataclass(eq=False, kw_only=True)
class ForceDoubts:
    """Where the assumed force cannot hold, found part by part of a path.

    Drills, ball tools, step-overs below the diameter, lateral rapids between cuts at their depth; none of them where a
    stock gives the engagement or no force acts.
    """

    config: Config
    tools: set[int] = field(default_factory=set)
    lines: set[int] = field(default_factory=set)
    _passes: Passes = field(default_factory=lambda: Passes())
    _flat: Bools = field(default_factory=lambda: np.zeros(0, np.bool_))  # of the last two motions, as the next ones
    _cuts: Bools = field(default_factory=lambda: np.zeros(0, np.bool_))
    _line: Ints = field(default_factory=lambda: np.zeros(0, np.int64))

    def add(self, path: Path) -> None:
        """Examine the next motions of a path."""
        if not _is_assumed(self.config):
            return
        known, way, top = path.known & ~path.machine, path.end - path.start, self.config.workpiece.stock_top_mm
        level = known & (np.abs(way[:, 2]) < LEVEL_MM) & (sizes(way[:, :2]) > LEVEL_MM)
        cut = level & (path.kind != RAPID) & (True if top is None else path.end[:, 2] < top)
        flat = np.concatenate((self._flat, level & (path.kind == RAPID)))
        cuts, line = np.concatenate((self._cuts, cut)), np.concatenate((self._line, path.line))
        feeds = np.flatnonzero(known & (path.kind != RAPID))
        tool = path.tool[feeds]
        numbers = distinct(tool)
        self.tools |= set(numbers)
        diameters = np.array([self._cutter(each).diameter_mm or 0.0 for each in numbers], float)
        self._passes.add(path, feeds, diameters[np.searchsorted(numbers, tool)])
        self.lines |= set(line[1:-1][flat[1:-1] & cuts[:-2] & cuts[2:]].tolist())
        self._flat, self._cuts, self._line = flat[-2:], cuts[-2:], line[-2:]

    def _cutter(self, number: int) -> Cutter:
        return self.config.tools.get(number, self.config.tool)

    def warnings(self) -> list[str]:
        """One warning per form of tool that is no flat mill, one with the source lines of the rapids, one on step-overs."""
        out = [
            f"the assumed force is that of a flat end mill, and the tool is a {kind}; {TWO_WAYS}"
            for kind in sorted({str(self._cutter(each).type) for each in self.tools} & {"ball", "drill"})
        ]
        if self.lines:
            where = f"G0 at cutting depth between two cuts at {named_lines(sorted(self.lines))}"
            out.append(
                f"{where}: the model has no force there, and the machine may cut at rapid speed; retract, or state the stock"
            )
        if (share := self._passes.beside_share()) > MIN_STEP_OVER_SHARE:
            out.append(
                f"{100.0 * share:.0f} % of the feed path runs less than one tool diameter beside an earlier pass; "
                f"the assumed force is too large there; {TWO_WAYS}"
            )
        return out


@dataclass(eq=False)
class Passes:
    """Samples of the lateral feed path, at most MOST_SAMPLES: beyond those, of every second tile of space, and so on."""

    point: Floats = field(default_factory=lambda: np.zeros((0, 3)))  # (k, 3) mm; heights stretched by LEVEL_STRETCH
    along: Floats = field(default_factory=lambda: np.zeros(0))  # (k,) path length in samples
    diameter: Floats = field(default_factory=lambda: np.zeros(0))  # (k,) mm, of the tool
    _length: float = 0.0  # of the path so far, in samples
    _every: int = 1  # one tile of so many is kept

    def add(self, path: Path, on: Ints, diameter: Floats) -> None:
        """Sample the lateral ones of the next motions `on` (n,) of a path; diameter (n,) mm, 0: not known."""
        length = path_geometry.lengths(path)[on]
        rise = np.abs(path.end[on, 2] - path.start[on, 2])
        lateral = (diameter > 0.0) & (rise < (1.0 - PLUNGE_SINE) * length) & (rise < 0.5 * length)
        on, diameter = on[lateral], diameter[lateral]
        count = length[lateral] / (SAMPLE_DIAMETERS * diameter)
        ends = self._length + np.cumsum(count)
        if not len(on):
            return
        first = np.floor(self._length + 0.5) + 0.5
        at = np.arange(first, ends[-1], max(1.0, np.ceil(count.sum() / MOST_AT_ONCE)))
        self._length = float(ends[-1])
        which = np.minimum(np.searchsorted(ends, at), len(on) - 1)
        u = np.clip(1.0 - (ends[which] - at) / count[which], 0.0, 1.0)
        self.point = np.concatenate((self.point, path_geometry.points(path, on[which], u) * [1.0, 1.0, LEVEL_STRETCH]))
        self.along, self.diameter = np.append(self.along, at), np.append(self.diameter, diameter[which])
        self._thin()

    def _thin(self) -> None:
        """Leave out tiles until the samples are few enough; that of the first sample is always kept."""
        if len(self.along) <= MOST_SAMPLES and self._every == 1:
            return
        size = TILE_DIAMETERS * self.diameter[0]
        tile = np.rint((self.point - self.point[0]) / size).astype(np.int64)
        mixed = (tile * [73_856_093, 19_349_663, 83_492_791]).sum(axis=1)
        mixed ^= mixed >> 13
        while (kept := mixed % self._every == 0).sum() > MOST_SAMPLES and self._every < 1 << 40:
            self._every *= 2
        self.point, self.along, self.diameter = self.point[kept], self.along[kept], self.diameter[kept]

    def beside_share(self) -> float:
        """Share of the lateral feed path next to an earlier pass of the same height by this or a wider tool."""
        beside = np.zeros(len(self.along), np.bool_)
        if len(beside) < 2:
            return 0.0
        from scipy.spatial import cKDTree  # not needed by most runs, and slow to import

        for each in np.unique(self.diameter):
            of = np.flatnonzero(self.diameter >= each)
            near, far = (share * each for share in STEP_OVER_DIAMETERS)
            pairs = of[cKDTree(self.point[of]).query_pairs(far, output_type="ndarray")]
            first, later = pairs.min(axis=1), pairs.max(axis=1)
            apart = sizes(self.point[first] - self.point[later])
            own = (self.diameter[later] == each) & (apart > near)
            beside[later[own & (self.along[later] - self.along[first] > 3.0 / SAMPLE_DIAMETERS)]] = True
        return float(self.diameter[beside].sum() / self.diameter.sum())
