"""Experiments that a machine can do next: small NC programs about the place where it has worked, and what they cost.

Costs are minutes of machine time, setting up included; they weigh one experiment against another and need no precision.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from camcomp.diagnosis.fit.bench import Bench
from camcomp.ground.datatypes import Floats

CHANNELS = ("tip", "encoder", "drive", "dyno")
_NEEDS = {
    "tip": ("the tip with a tracker", 30.0),
    "encoder": ("the encoders", 5.0),
    "drive": ("the drive forces", 5.0),
    "dyno": ("the force on the tool with a dynamometer", 20.0),
}
_SETUP_MIN = 1.0
_LATER_MIN = 60.0
_DWELL_S = 900.0
# What can be measured by other means: effect, parameter, what to measure, minutes, deviation.
_BY_HAND = (
    ("tool_length", "length_mm", "the tool on a presetter", 5.0, 0.003),
    ("joint_offset", "offset_mm", "the carriages against their encoders at home with a gauge", 20.0, 0.003),
    ("gravity", "weight_N", "the platform, spindle and tool on a balance", 30.0, 0.5),
)


@dataclass(frozen=True, eq=False)
class Candidate:
    """A feasible experiment. program: NC text; channels: what it logs; minutes: what it costs; stay_s: how long it is
    logged after the last motion; knows: parameters (effect, name) that it measures by other means, with their deviation;
    varies: covariates that it changes while the others stay as they were.
    """

    action: str
    program: str
    cutting: bool
    channels: tuple[str, ...]
    started: float
    minutes: float
    stay_s: float = 0.0
    knows: tuple[tuple[str, str, float], ...] = ()
    varies: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Site:
    """Where and how the machine has worked: centre (3,) mm, radius mm, feed mm/min, end of the last run s, channels."""

    centre: Floats
    radius: float
    feed: float
    end: float
    channels: tuple[str, ...]

    @property
    def minutes(self) -> float:
        """Cost of a circle."""
        return 2.0 * np.pi * self.radius / self.feed + _SETUP_MIN


def site_of(bench: Bench) -> Site:
    """The place where the runs of a bench have been."""
    runs = bench.runs
    tips = np.concatenate([reading.tip for reading in bench.nominal])
    low, high = np.quantile(tips, 0.02, axis=0), np.quantile(tips, 0.98, axis=0)
    feeds = [run.run_path.feed_mm_per_min for run in runs if np.isfinite(run.run_path.feed_mm_per_min)]
    return Site(
        np.round(0.5 * (low + high), 1),
        round(float(np.clip(0.5 * np.min((high - low)[:2]), 5.0, 40.0)), 1),
        round(float(np.median(feeds))) if feeds else 1000.0,
        max(run.run_path.started + float(run.run_path.time[-1]) for run in runs),
        tuple(c for c in CHANNELS if any(run.measured.has(c) for run in runs)),
    )


def candidates(site: Site) -> Iterator[Candidate]:
    """Feasible experiments, cheap ones first. Away from the place of work the machine moves in the air."""
    have, soon = site.channels, site.end + 60.0

    def circle(action: str, turn: int = 1, cutting: bool = True, at: Sequence[float] = (0.0, 0.0, 0.0), faster: float = 1.0,
               wider: float = 1.0, plane: str = "G17", varies: tuple[str, ...] = ()) -> Candidate:  # fmt: skip
        text = circle_program(action, site.centre + np.array(at), wider * site.radius, faster * site.feed, turn, plane)
        minutes = _SETUP_MIN + (site.minutes - _SETUP_MIN) * wider / faster
        return Candidate(action, text, cutting, have, soon, minutes, varies=varies)

    usual = circle("circle, counter-clockwise")
    yield circle("circle in the reverse direction, clockwise", turn=-1, varies=("reversal", "direction"))
    yield circle("circle at another feed, four times as fast", faster=4.0, varies=("velocity", "acceleration"))
    yield circle("circle at another feed, half as fast", faster=0.5, varies=("velocity", "acceleration"))
    yield circle("circle in the air, without cutting", cutting=False, varies=("force",))
    yield circle("circle of twice the radius, in the air", cutting=False, wider=2.0)
    for x, y, z in ((60, 60, 0), (-40, -40, 0), (-60, -60, 0), (60, -60, 0), (0, 0, 60)):
        action = f"circle in the air at another place, off by X{x} Y{y} Z{z} mm"
        yield circle(action, cutting=False, at=(x, y, z), varies=("position",))
    yield circle("circle in another plane (XZ), in the air", cutting=False, plane="G18")
    for axis, name in enumerate("XYZ"):
        action = f"single-axis ladder along {name}, up and down, in the air"
        text = ladder_program(action, site.centre, site.radius, site.feed, axis)
        yield Candidate(action, text, False, have, soon, 4.0 * site.radius / site.feed + _SETUP_MIN)
    for channel, (name, cost) in _NEEDS.items():
        if channel not in have:
            action = f"circle, counter-clockwise, and log {name} as well"
            text = circle_program(action, site.centre, site.radius, site.feed, 1)
            yield Candidate(action, text, True, (*have, channel), soon, usual.minutes + cost)
    for effect, parameter, what, minutes, deviation in _BY_HAND:
        action = f"measure {what}, state what is found under effects: in the config, diagnose again --without {effect}"
        text = circle_program(action, site.centre, site.radius, site.feed, 1)
        yield replace(
            usual, action=action, program=text, minutes=minutes + usual.minutes, knows=((effect, parameter, deviation),)
        )
    action = "dwell: stand still for 15 minutes and log"
    yield Candidate(
        action, dwell_program(action, site.centre, site.feed, _DWELL_S), False, have, soon, _DWELL_S / 60.0 + _SETUP_MIN,
        stay_s=_DWELL_S, varies=("time", "temperature"),
    )  # fmt: skip
    later = "repeat later: the same circle after one hour of running"
    yield replace(
        usual, action=later, program=circle_program(later, site.centre, site.radius, site.feed, 1),
        started=site.end + 60.0 * _LATER_MIN, minutes=usual.minutes + _LATER_MIN, varies=("time", "temperature"),
    )  # fmt: skip


def circle_program(action: str, centre: Floats, radius: float, feed: float, turn: int, plane: str = "G17") -> str:
    """NC text of one full circle; turn +1 counter-clockwise, -1 clockwise, seen from the plane's positive axis."""
    x, y, z = (float(v) for v in centre)
    word = "G3" if turn > 0 else "G2"
    offset = f"I{-radius:.4f} J0" if plane == "G17" else f"I{-radius:.4f} K0"
    place = f"X{x + radius:.4f} Y{y:.4f} Z{z:.4f}"
    return _program(action, plane, f"G0 {place}\n{word} {place} {offset} F{feed:.0f}\n")


def ladder_program(action: str, centre: Floats, reach: float, feed: float, axis: int) -> str:
    """NC text of five steps up and five down along one axis."""
    letter = "XYZ"[axis]
    start = centre.copy()
    start[axis] -= reach
    x, y, z = (float(v) for v in start)
    stops = [start[axis] + 2.0 * reach * i / 5.0 for i in (1, 2, 3, 4, 5, 4, 3, 2, 1, 0)]
    moves = "".join(f"G1 {letter}{s:.4f} F{feed:.0f}\n" for s in stops)
    return _program(action, "G17", f"G0 X{x:.4f} Y{y:.4f} Z{z:.4f}\n{moves}")


def dwell_program(action: str, centre: Floats, feed: float, seconds: float) -> str:
    """NC text of one short move and a dwell at its end."""
    x, y, z = (float(v) for v in centre)
    return _program(action, "G17", f"G0 X{x - 1.0:.4f} Y{y:.4f} Z{z:.4f}\nG1 X{x:.4f} F{feed:.0f}\nG4 P{seconds:.0f}\n")


def _program(action: str, plane: str, body: str) -> str:
    say = action.replace("(", "").replace(")", "")
    return f"(experiment proposed by camcomp)\n({say})\nG21 G90 {plane} G54\n{body}M2\n"
