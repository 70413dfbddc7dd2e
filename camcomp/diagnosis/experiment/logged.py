"""The log of a run with the machine that made it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from camcomp.diagnosis.fit.measured import Measured
from camcomp.ground.datatypes import Bools, Floats
from camcomp.ground.errors import ConfigError, Location
from camcomp.model.motion.driven_path import Forces, driven_path
from camcomp.model.motion.run_path import RunPath
from camcomp.model.motion.twin import Twin


@dataclass(frozen=True, eq=False, kw_only=True)
class Logged:
    """The log of a run: file and run for messages; started: s on the common clock; temperature (n,) or None; acceleration: of
    the controller, mm/s2.
    """

    file: str
    run: str
    measured: Measured
    twin: Twin
    started: float
    temperature: Floats | None
    acceleration: float

    @property
    def revolute(self) -> Bools:
        """Whether an actuator is a hinge (m,)."""
        return np.array([a.revolute for a in self.twin.robot.actuators])

    def refusal(self, rule: str, message: str) -> ConfigError:
        """The error of a rule in this log."""
        return ConfigError(rule, f"run '{self.run}'{message}", at=Location(self.file, 1, 1))

    def path(self, rho: Floats, tip: Floats, forces: Forces, rotation: Floats | None) -> RunPath:
        """Run path of actuators (n, m) with their tips (n, 3), program frame, and rotations (n, 3, 3) of the platform."""
        return driven_path(
            self.twin, self.run, time=self.measured.time, rho=rho, tip=tip, forces=forces, started=self.started,
            temperature=self.temperature, rotation=rotation,
        )  # fmt: skip

    def over_time(self, values: Floats, known: Bools | None = None) -> Floats:
        """Values (n, c) with empty cells, and rows that are not known (n,), interpolated over time."""
        seen = values if known is None else np.where(known[:, None], values, np.nan)
        time, there = self.measured.time, np.isfinite(seen)
        return np.column_stack([np.interp(time, time[on], v[on]) for v, on in zip(seen.T, there.T, strict=True)])
