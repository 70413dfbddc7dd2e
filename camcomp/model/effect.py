"""Types of effects: a module with parameters and hooks describes one difference between a machine and its model.

camcomp/plugins/effects.py states the interface of such a module and the arguments of its hooks.
camcomp/model/signal_path.py calls the hooks, stage by stage, effects in the order of the config.
"""

from collections.abc import Callable, Mapping
from functools import cache
from typing import Any, Literal, Self

import numpy as np

from camcomp.ground.datatypes import Floats, Ints
from camcomp.ground.errors import Location
from camcomp.ground.records import dataclass, field, replace
from camcomp.model.seams import Seams
from camcomp.model.statics.masses import MassLoads

Target = Literal["actuator", "machine", "either", "named"]


@dataclass(frozen=True)
class Parameter:
    """One number of an effect: unit, bounds and prior size.

    `scale` is the typical size where the effect is present, `tolerance` the size on a healthy machine; both in `unit`, or as
    differences of the natural logarithm where `log` (factors). `sign` +1: never below nominal.

    A shape parameter (a pitch, a time constant) has no influence while the effect is absent:
    `scan`: its starting values. `turns`: it is a period of the drive's travel, which has to contain at least so many periods
    to identify it. `placed`: it is an instant on the common clock. `either`: it takes one of these values; the fit chooses.
    """

    name: str
    unit: str
    nominal: float
    low: float
    high: float
    scale: float
    tolerance: float
    source: str
    sign: int = 0
    log: bool = False
    scan: tuple[float, ...] = ()
    placed: bool = False
    turns: float = 0.0
    either: tuple[float, ...] = ()

    @property
    def shape(self) -> bool:
        """Whether it is a shape parameter: without influence while the effect is absent."""
        return bool(self.scan or self.either)

    def value(self, coordinate: float) -> float:
        """Physical value at a fitting coordinate (0 = nominal), kept inside the bounds."""
        if self.shape:
            value = coordinate
        else:
            value = self.nominal * float(np.exp(min(coordinate, 700.0))) if self.log else self.nominal + coordinate
        return float(min(max(value, self.low), self.high))

    def coordinate(self, value: float) -> float:
        """Fitting coordinate of a physical value."""
        if self.shape:
            return value
        return float(np.log(value / self.nominal)) if self.log else value - self.nominal

    def on_top(self, before: float, found: float) -> float:
        """Value of a finding on top of a stated value: sum, product for factors; a shape is as it is found."""
        return found if self.shape else self.value(self.coordinate(before) + self.coordinate(found))


@dataclass(frozen=True, eq=False, kw_only=True)
class Motion:
    """Motion of the machine through n instants in order, as hooks see it; m actuators, mm or rad, s.

    `direction` is the sign of travel with memory: +1, -1, between them within the presliding distance of a reversal, 0
    before the first move. `ordered` is false for poses that are not a movement. `held` computes the modelled forces of the
    drives `names` against the load; `told` the tips of the set-points; `masses` the loads of the stated masses; `stated_loads`
    those on the drives by weight and by inertia, where the drives are at other positions (n, m). These four are None where they
    are unknown.
    """

    time: Floats  # (n,) s since the start of the run
    common: Floats  # (n,) s on the clock shared by all runs
    cut_min: Floats  # (n,) minutes of cutting so far, over all runs
    temperature: Floats | None  # (n,) deg C
    encoder: Floats  # (n, m)
    speed: Floats  # (n, m) of the encoder, per s
    direction: Floats  # (n, m)
    home: Floats  # (m,)
    stiffness: Floats  # (m,) of the drives, N/mm or N mm/rad; inf = rigid
    ordered: bool = True
    nut: Floats | None = None  # (n, m) encoder plus errors of the screw, for guides; None: as the encoder
    names: tuple[str, ...] = ()  # of the actuators
    held: Callable[[], Floats] | None = None  # (n, m) N or N mm
    told: Callable[[], Floats] | None = None  # (n, 3) mm, program frame
    cut_before_min: float = 0.0  # part of cut_min in earlier runs
    masses: Callable[[], MassLoads] | None = None
    came: Floats | None = None  # (n, m) by which way a standing drive came: 1 or -1, 0 where unknown
    stated_loads: Callable[["Motion", Floats], tuple[Floats, Floats]] | None = None
    friction: Floats | None = None  # (m,) Coulomb force behind the play of a drive, N or N mm; NaN: not stated
    seams: Seams | None = None  # where a recording begins or goes on in motion; None: it starts at rest
    measured_force: bool = False  # the cutting force is measured, so that errors of a force model do not act

    def at(self, instants: Ints | slice) -> Self:
        """Some of the instants, as unordered poses without the functions of all instants."""
        return replace(
            self,
            time=self.time[instants],
            common=self.common[instants],
            cut_min=self.cut_min[instants],
            temperature=None if self.temperature is None else self.temperature[instants],
            encoder=self.encoder[instants],
            speed=self.speed[instants],
            direction=self.direction[instants],
            came=None if self.came is None else self.came[instants],
            nut=None if self.nut is None else self.nut[instants],
            held=None,
            told=None,
            masses=self.masses_at(lambda values: values[instants]),
            seams=None,
        )

    def masses_at(self, rows: Callable[[Floats], Floats]) -> Callable[[], MassLoads] | None:
        """`masses` at other instants; rows: values (n, c) -> (k, c)."""
        masses = self.masses
        return None if masses is None else cache(lambda: masses().at(rows))


@dataclass(frozen=True, eq=False)
class Load:
    """Load on the tool in the machine frame: cutting force at the tip, and wrench at the platform reference."""

    force: Floats  # (n, 3) N
    wrench: Floats  # (n, 6) N, N mm


@dataclass(frozen=True, eq=False)
class Axes:
    """Axes X, Y, Z of a machine at n instants, as hooks of guideways see them; mm, machine frame.

    `position` is that of the platform reference, which equals the readings of the scales on a machine of slides.
    `direction` is the sign of travel with memory, 0 where no slide moves along the axis. `arm` leads from the carriage of
    an axis to the tip: along the tool, and along the axes that the carriage carries.
    """

    place: Floats  # (n, 3) of the tip, from the program's origin
    position: Floats  # (n, 3)
    direction: Floats  # (n, 3)
    arm: Floats  # (n, 3 axes, 3)


@dataclass(frozen=True)
class Cause:
    """An effect in use: module, target, parameter values, and location in the config."""

    name: str
    effect: Any
    target: str | None  # an actuator, one of the effect's TARGETS, or None
    values: Mapping[str, Any] = field(default_factory=dict)
    at: Location | None = field(default=None, compare=False)

    def which(self, actuators: tuple[str, ...]) -> Floats:
        """Mask (m,) of the actuators on which this cause acts, 1.0 or 0.0."""
        return np.array([1.0 if self.target in (None, each) else 0.0 for each in actuators])

    def aimed(self, actuators: tuple[str, ...]) -> tuple[str, ...]:
        """Names of the actuators on which this cause acts."""
        return tuple(each for each in actuators if self.target in (None, each))

    @property
    def uncorrectable(self) -> bool:
        """Whether set-points cannot correct its error; compensate then ignores it."""
        return bool(getattr(self.effect, "UNCORRECTABLE", False))

    def hook(self, name: str) -> Any:
        """The hook called `name`, or None."""
        return getattr(self.effect, name, None)


def applies(effect: Any, robot: Any, target: str | None) -> bool:
    """Whether an effect at a target of a robot is a candidate of the diagnosis."""
    return not hasattr(effect, "applies") or bool(effect.applies(robot, target))


def public_values(effect: Any, values: Mapping[str, float]) -> dict[str, float]:
    """Values of the parameters that a file has, from those in which an effect is fitted; nominal where one is missing."""
    if not hasattr(effect, "public"):
        return dict(values)
    fitted = {p.name: p.nominal for p in getattr(effect, "FITTED", effect.PARAMETERS)}
    return dict(effect.public({**fitted, **values}))


def nominal(effect: Any) -> dict[str, float]:
    """Parameter values at which the effect vanishes."""
    return {each.name: each.nominal for each in effect.PARAMETERS}
