"""Covariates of a law: names with units, and their values per row from motion, load and tip."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from functools import cached_property

import numpy as np

from camcomp.ground.datatypes import Bools, Floats
from camcomp.ground.records import dataclass, field
from camcomp.model.effect import Load, Motion
from camcomp.model.statics.description import Robot
from camcomp.model.statics.masses import weight_and_inertia

_TIME = {
    "temp_C": "temperature of the drives",
    "t_s": "time since the run began",
    "common_s": "time on the clock that all runs share",
    "cut_min": "minutes that the tool has cut",
}
AT_TIP = {
    **{f"{a}_mm": f"place of the tip along program {a}, where the set-points lead it" for a in "xyz"},
    **{f"v{a}_mm_per_s": f"its velocity along program {a}" for a in "xyz"},
    "feed_mm_per_s": "its speed",
    "heading_rad": "direction of travel in the program's XY plane, from X towards Y; at standstill the last one",
    "moving": "1 where the tip travels in the program's XY plane, 0 where it stands or plunges",
    **{f"f{a}_N": f"cutting force on the tool along machine {a}" for a in "xyz"},
    "force_N": "size of the cutting force on the tool",
    **_TIME,
}
AT_DRIVE = {
    "act_mm": "position of a slide",
    "act_mm_per_s": "its velocity",
    "act_mm_per_s2": "its acceleration",
    "act_rad": "position of a hinge",
    "act_rad_per_s": "its velocity",
    "act_rad_per_s2": "its acceleration",
    "followed_mm": "position that the effects listed above make of the set-points of a slide, at the stage control; what depends on it pushes the loop, which follows as late",
    "followed_mm_per_s": "its velocity",
    "followed_mm_per_s2": "its acceleration",
    "followed_rad": "the same of a hinge",
    "followed_rad_per_s": "its velocity",
    "followed_rad_per_s2": "its acceleration",
    **_TIME,
}
FOLLOWED_LOADS = {
    "followed_weight_N": "force of a slide's drive against the weight of the stated masses, at the positions that the effects listed above make of the set-points of all actuators; 0 where no masses are stated",
    "followed_weight_Nmm": "torque of a hinge's drive against it",
    "followed_inertia_N": "force of a slide's drive that accelerates these masses, by the motion of all actuators",
    "followed_inertia_Nmm": "torque of a hinge's drive that does",
}
LOADS = {
    "load_N": "force that the drive exerts on its slide against load and weight, as modelled",
    "load_Nmm": "torque that the drive of a hinge exerts",
    "load_<a>_N": "force of another drive, of actuator <a>",
    "load_<a>_Nmm": "torque of another drive",
}
_LOAD = re.compile(r"load(?:_(\w+))?_(?:N|Nmm)")
REFERENCE_C = 20.0
LOAD_STEP_S = 0.005  # between instants at which loads of masses are worked out, in a straight line between them
SMOOTH_S = 0.02  # over which the motion behind a loop is smooth


@dataclass(frozen=True, eq=False)
class TipRows(Mapping[str, Floats]):
    """Covariates of n rows at the tip, computed on access.

    Positions are those commanded by the set-points where they are known, because errors of axes and guides depend on the
    commanded position: under load the tip of a robot may be a millimetre away from it. tip (n, 3) mm in the program frame
    is used otherwise.
    """

    tip: Floats
    load: Load
    motion: Motion
    _known: dict[str, Floats] = field(default_factory=dict)

    def __getitem__(self, name: str) -> Floats:
        if name not in self._known:
            self._known[name] = self._of(name)
        return self._known[name]

    def __iter__(self) -> Iterator[str]:
        return iter(AT_TIP)

    def __len__(self) -> int:
        return len(AT_TIP)

    @property
    def rows(self) -> int:
        """How many, n."""
        return len(self.tip)

    def _of(self, name: str) -> Floats:
        if name in _TIME:
            return _of_time(name, self.motion)
        if name[1:] == "_mm":
            return self._place[:, "xyz".index(name[0])]
        if name == "force_N":
            return np.asarray(np.linalg.norm(self.load.force, axis=1))
        if name[0] == "f" and name[2:] == "_N":
            return self.load.force[:, "xyz".index(name[1])]
        velocity = rate(self._place, self.motion)
        if name[0] == "v":
            return velocity[:, "xyz".index(name[1])]
        if name == "feed_mm_per_s":
            return np.asarray(np.linalg.norm(velocity, axis=1))
        if name == "heading_rad":
            return _kept_angle(velocity)
        if name == "moving":
            return _moving(velocity).astype(float)
        raise KeyError(name)

    @property
    def _place(self) -> Floats:
        return self.tip if self.motion.told is None else self.motion.told()


@dataclass(frozen=True, eq=False)
class DriveRows(Mapping[str, Floats]):
    """Covariates of n rows at drive j, computed on access: of its set-points at the stage control, else of its encoder.

    loads: names of drive loads that iteration lists in addition; access works for any. followed (n, m): positions of all
    drives behind the effects above the law, mm or rad; None: as `motion` has them.
    """

    motion: Motion
    j: int
    loads: tuple[str, ...] = ()
    followed: Floats | None = None
    _known: dict[str, Floats] = field(default_factory=dict)

    def __getitem__(self, name: str) -> Floats:
        if name not in self._known:
            self._known[name] = self._of(name)
        return self._known[name]

    def _of(self, name: str) -> Floats:
        if name in _TIME:
            return _of_time(name, self.motion)
        if is_load(name):
            return self._load(load_of(name))
        if name in FOLLOWED_LOADS:
            return self._weight_and_inertia["inertia" in name][:, self.j]
        whose, _, unit = name.partition("_")
        position = (self.motion.encoder if whose == "act" else self._followed)[:, self.j]
        order = {"": 0, "_per_s": 1, "_per_s2": 2}[unit.removeprefix("mm").removeprefix("rad")]
        if whose == "followed" and order:
            return smooth_rate(position, self.motion, order)
        for _ in range(order):
            position = rate(position[:, None], self.motion)[:, 0]
        return position

    @property
    def _followed(self) -> Floats:
        return self.motion.encoder if self.followed is None else self.followed

    @cached_property
    def _weight_and_inertia(self) -> tuple[Floats, Floats]:
        """Loads (n, m) of the stated masses on all drives."""
        if self.motion.stated_loads is None:
            return np.zeros_like(self._followed), np.zeros_like(self._followed)
        return self.motion.stated_loads(self.motion, self._followed)

    def _load(self, actuator: str | None) -> Floats:
        """Force (n,) N or torque N mm of this drive or another one; zero where the load is unknown."""
        if self.motion.held is None:
            return np.zeros(self.rows)
        return self.motion.held()[:, self.j if actuator is None else self.motion.names.index(actuator)]

    def __iter__(self) -> Iterator[str]:
        return iter((*AT_DRIVE, *self.loads))

    def __len__(self) -> int:
        return len(AT_DRIVE) + len(self.loads)

    @property
    def rows(self) -> int:
        """How many, n."""
        return len(self.motion.time)


def loads_along(robot: Robot, motion: Motion, q: Floats) -> tuple[Floats, Floats]:
    """Loads (n, m) of the stated masses on rigid drives, by weight and by inertia, of drives at q (n, m) in a motion."""
    rates = (np.stack([smooth_rate(each, motion, order) for each in q.T], axis=1) for order in (1, 2))
    if not motion.ordered or not len(q):
        return weight_and_inertia(robot, q, *rates)
    some = np.union1d(np.unique(np.floor(motion.time / LOAD_STEP_S), return_index=True)[1], len(q) - 1)
    loads = weight_and_inertia(robot, *(each[some] for each in (q, *rates)))
    weight, inertia = (
        np.stack([np.interp(motion.time, motion.time[some], own) for own in load.T], axis=1) for load in loads
    )
    return weight, inertia


def is_load(name: str) -> bool:
    """Whether a covariate is the load of a drive."""
    return _LOAD.fullmatch(name) is not None


def load_of(name: str) -> str | None:
    """The actuator that the load of a drive names; None: its own."""
    found = _LOAD.fullmatch(name)
    return found[1] if found else None


def rate(values: Floats, motion: Motion) -> Floats:
    """Rate of change per second (n, k) of values (n, k); 0 for poses that are no movement."""
    t = motion.time
    if not motion.ordered or len(t) < 2:
        return np.zeros_like(values)
    apart = np.concatenate([[True], np.diff(t) > 1e-9])  # repeated instants count once
    if apart.sum() < 2:
        return np.zeros_like(values)
    found = np.gradient(values[apart], t[apart], axis=0)
    return np.asarray(found[np.cumsum(apart) - 1])


def smooth_rate(values: Floats, motion: Motion, order: int) -> Floats:
    """Derivative (n,) of values (n,) in time by local cubics over SMOOTH_S, five rows at least; set-points are rounded.

    Source: Savitzky, Golay, Analytical Chemistry 36 (1964) 1627.
    """
    from scipy.signal import savgol_filter  # only laws of the motion behind a loop wait for it

    t = motion.time
    apart = np.concatenate([[True], np.diff(t) > 1e-9]) if len(t) else np.zeros(0, bool)
    if not motion.ordered or apart.sum() < 2:
        return np.zeros_like(values)
    step = float(np.median(np.diff(t[apart])))
    rows = 2 * max(round(0.5 * SMOOTH_S / step), 2) + 1
    even = t[0] + step * np.arange(max(round((t[-1] - t[0]) / step) + 1, rows))
    from_first = np.interp(even, t[apart], values[apart] - values[0])  # exactly 0 at rest
    found = savgol_filter(from_first, rows, 3, deriv=order, delta=step, mode="interp")
    return np.asarray(np.interp(t, even, found), float)


def _moving(velocity: Floats) -> Bools:
    """Whether rows (n,) travel in the plane."""
    speed = np.hypot(velocity[:, 0], velocity[:, 1])
    return np.asarray(speed > 1e-3 * max(float(speed.max(initial=0.0)), 1e-9))


def _kept_angle(velocity: Floats) -> Floats:
    """Heading (n,) rad; at standstill that of the last move, at first that of the first."""
    moving = _moving(velocity)
    if not moving.any():
        return np.zeros(len(velocity))
    last = np.maximum.accumulate(np.where(moving, np.arange(len(velocity)), -1))
    last = np.where(last < 0, int(np.argmax(moving)), last)
    return np.asarray(np.arctan2(velocity[last, 1], velocity[last, 0]))


def _of_time(name: str, motion: Motion) -> Floats:
    if name == "temp_C":
        return np.full(len(motion.time), REFERENCE_C) if motion.temperature is None else motion.temperature
    return {"t_s": motion.time, "common_s": motion.common, "cut_min": motion.cut_min}[name]
