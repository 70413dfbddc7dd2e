"""Feasible experiments: a coarse grid of designs about the region of work, and additional channels.

In the air the tool stays above `Site.low`; it cuts only where the runs have cut, at their speed.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np

from camcomp.diagnosis.next_experiment.design import PLANES, MotionDesign
from camcomp.diagnosis.next_experiment.site import Site
from camcomp.ground.datatypes import Floats

LATER_S = 3600.0  # delay of a later run
DWELL_S = 900.0  # duration of a standstill that shows a drift
FASTER = (0.25, 1.0, 4.0)  # times the feed of the runs, in the air
CUT_FASTER = (0.5, 1.0, 1.5)  # times the feed of the runs, cutting
OUT = (0.5, 0.9)  # of the reach: distances of circles
SMALL = 0.3  # of the reach: radius of a distant circle; of the radius of work: that of a small one
_NEEDS = {
    "tip": ("the tip with a tracker", 30.0),
    "encoder": ("the set-points and the encoders", 5.0),
    "drive": ("the drive forces", 5.0),
    "dyno": ("the force on the tool with a dynamometer", 20.0),
}
# What can be measured by other means: effect, parameter, what to measure, minutes, deviation.
_BY_HAND = (
    ("tool_length", "length_mm", "the tool on a presetter", 5.0, 0.003),
    ("joint_offset", "offset_mm", "the carriages against their encoders at home with a gauge", 20.0, 0.003),
    ("gravity", "weight_N", "the platform, spindle and tool on a balance", 30.0, 0.5),
)


@dataclass(frozen=True, eq=False, kw_only=True)
class Candidate:
    """A feasible experiment.

    channels: logged ones; started: s on the common clock; minutes: of machine time and work; knows: parameters (effect,
    name) measured by other means, with their deviation; varies: covariates that change while all others are kept.
    """

    action: str
    design: MotionDesign
    channels: tuple[str, ...]
    started: float
    minutes: float
    knows: tuple[tuple[str, str, float], ...] = ()
    varies: tuple[str, ...] = ()

    @property
    def program(self) -> str:
        """NC text of the motion itself."""
        return self.design.program(self.action)

    @property
    def cutting(self) -> bool:
        """Whether the experiment cuts."""
        return self.design.cutting


def candidate(site: Site, design: MotionDesign, varies: tuple[str, ...] = ()) -> Candidate:
    """Experiment of a design, with the channels of the runs."""
    design = design.tidy()
    return Candidate(
        action=design.action, design=design, channels=site.channels, started=site.end + design.wait_s,
        minutes=design.minutes, varies=varies,
    )  # fmt: skip


def usual(site: Site) -> MotionDesign:
    """Circle with the position, size and feed of the runs."""
    place = site.work if site.cut is None else site.cut
    cutting = site.cut is not None
    return _in_air(
        site, MotionDesign(centre=_triple(place.centre), radius=place.radius, feed=place.feed, cutting=cutting)
    )


def coarse(site: Site) -> Iterator[Candidate]:
    """Coarse grid of designs: region of work, distant, large, other planes, straight, slow and fast, later."""
    base = usual(site)
    if site.cut is not None:
        yield from (candidate(site, replace(base, feed=times * site.cut.feed)) for times in CUT_FASTER)
        yield candidate(site, replace(base, radius=SMALL * base.radius))
    for times in FASTER:
        yield _air(site, base, feed=times * base.feed)
    middle, ways, reaches = _reaches(site, base)
    for way, far in zip(ways, reaches, strict=True):
        for share in OUT if np.count_nonzero(way) == 1 else OUT[-1:]:
            if far > 0.0:
                yield _air(site, base, centre=_triple(middle + share * (1.0 - SMALL) * far * way), radius=SMALL * far)
    flat = OUT[-1] * min(far for way, far in zip(ways, reaches, strict=True) if abs(way[0]) + abs(way[1]) == 1.0)
    up = OUT[-1] * float(reaches[np.argmax(ways @ [0.0, 0.0, 1.0])])
    for plane in PLANES:
        radius = flat if plane == "XY" else min(flat, 0.5 * up)
        if radius > 0.0:
            yield _air(site, base, radius=radius, plane=plane)
    diagonals = np.array([[0.5**0.5, 0.5**0.5, 0.0], [0.5**0.5, -(0.5**0.5), 0.0]])
    for line in np.concatenate([np.eye(3), diagonals]):
        ends = OUT[-1] * site.reaches(middle, np.array([line, -line]))
        if (half := 0.5 * float(ends.sum())) > 0.0:
            centre = middle + 0.5 * float(ends[0] - ends[1]) * line
            yield _air(site, base, centre=_triple(centre), radius=half, along=_triple(line))
    yield from in_time(site)


def in_time(site: Site) -> Iterator[Candidate]:
    """Experiments about time: standstills, and later repetitions."""
    base = usual(site)
    yield _air(site, base, ("time", "temperature"), dwell_s=DWELL_S)
    yield candidate(site, replace(base, wait_s=LATER_S), varies=("time", "temperature"))


def by_other_means(site: Site) -> Iterator[Candidate]:
    """The usual circle with an additional channel, or with a parameter measured by hand before it."""
    design = usual(site)
    base = candidate(site, design)
    for channel, (name, cost) in _NEEDS.items():
        if channel not in site.channels:
            action = f"{base.action}, and log {name} as well"
            yield replace(base, action=action, channels=(*site.channels, channel), minutes=base.minutes + cost)
    base = _air(site, design)
    for effect, parameter, what, cost, deviation in _BY_HAND:
        action = f"measure {what} and state what is found under effects: in the config; {base.action}; diagnose again --without {effect}"
        yield replace(base, action=action, minutes=base.minutes + cost, knows=((effect, parameter, deviation),))


def single_changes(site: Site) -> Iterator[Candidate]:
    """Repetitions of the runs with one covariate changed, for unknown causes."""
    base = usual(site)
    yield candidate(site, replace(base, turns=(-1,)), ("reversal", "direction"))
    if not base.cutting:
        yield candidate(site, replace(base, feed=4.0 * base.feed), ("velocity", "acceleration"))
    yield candidate(site, replace(base, feed=0.5 * base.feed), ("velocity", "acceleration"))
    if base.cutting:
        yield _air(site, base, ("force",))
    middle, ways, reaches = _reaches(site, base)
    far = float(reaches.max())
    centre = _triple(middle + (1.0 - SMALL) * far * ways[int(np.argmax(reaches))])
    yield _air(site, base, ("position",), centre=centre, radius=min(base.radius, SMALL * far))
    yield from in_time(site)


def _reaches(site: Site, base: MotionDesign) -> tuple[Floats, Floats, Floats]:
    """Centre (3,) of a design in the air, unit directions (k, 3) along the axes and to the corners, and how far (k,) they reach."""
    every = np.array([w for w in product((1.0, 0.0, -1.0), repeat=3) if sum(map(abs, w)) in (1.0, 3.0)])
    ways = every / np.linalg.norm(every, axis=1)[:, None]
    middle = np.array(_in_air(site, replace(base, cutting=False)).centre)
    return middle, ways, site.reaches(middle, ways)


def _air(site: Site, base: MotionDesign, varies: tuple[str, ...] = (), **changes: Any) -> Candidate:
    """Experiment of a design in the air with some changes."""
    here = _in_air(site, replace(base, cutting=False))
    return candidate(site, _in_air(site, replace(here, **changes)), varies)


def _in_air(site: Site, design: MotionDesign) -> MotionDesign:
    """The design raised above obstacles (`Site.low`)."""
    if design.cutting:
        return design
    x, y, z = design.centre
    low = float(design.points()[:, 2].min())
    return replace(design, centre=(x, y, z + max(site.low - low, 0.0)))


def _triple(point: Floats) -> tuple[float, float, float]:
    x, y, z = (float(v) for v in point)
    return x, y, z
