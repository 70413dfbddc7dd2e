"""An empirical law: its formula, its channel, and the envelope of the covariates that support it.

Inside the envelope the law holds in full; outside, where no data support it, it fades smoothly to zero over a tenth of the
envelope's width.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal, Protocol

import numpy as np

from camcomp.ground.datatypes import Floats
from camcomp.ground.notes import note
from camcomp.ground.records import dataclass
from camcomp.model.law.covariates import DriveRows, TipRows

On = Literal["control", "drive", "structure", "tool", "workpiece"]
AT_DRIVES = ("control", "drive")
FADE = 0.1  # of the envelope's width: distance outside over which a law fades to zero


class Shape(Protocol):
    """A formula or a map."""

    @property
    def names(self) -> tuple[str, ...]:
        """The covariates it depends on."""

    def __call__(self, rows: Mapping[str, Floats], n: int) -> Floats:
        """Values (n,)."""


@dataclass(frozen=True, eq=False, kw_only=True)
class EmpiricalLaw:
    """A formula or map with channel, envelope and factor.

    on: control and drive shift actuators (mm or rad), the others the tip along `axis` of the program (0 to 2), mm.
    envelope: covariate -> (low, high) of the supporting data; factor: multiplies the values.
    """

    on: str
    shape: Shape
    envelope: Mapping[str, tuple[float, float]]
    axis: int = 0
    factor: float = 1.0
    label: str = ""

    @property
    def deflects(self) -> bool:
        """Whether it is a push on a control loop, which is followed as set-points are: a law of the motion behind the loop."""
        return self.on == "control" and any(name.startswith("followed") for name in self.shape.names)

    def values(self, rows: TipRows | DriveRows) -> Floats:
        """Error (n,) that the law adds; it fades outside the envelope, with one warning."""
        n = rows.rows
        out = self.factor * self.shape(rows, n)
        if self.factor == 0.0 or not self.envelope:
            return out
        weight, left = np.ones(n), []
        for name, (low, high) in self.envelope.items():
            own = inside(rows[name], low, high)
            if n and own.min() < 0.5:
                left.append((name, low, high))
            weight *= own
        if left:
            name, low, high = left[0]
            note(
                f"law outside its envelope {self.label}",
                f"{self.label or 'a law'} was seen for {name} from {low:g} to {high:g}; beyond that it fades to nothing",
            )
        return out * weight


def inside(value: Floats, low: float, high: float) -> Floats:
    """1 from low to high, 0 beyond FADE of the width outside, smooth in between (n,)."""
    margin = max(FADE * (high - low), 0.01 * max(abs(low), abs(high)), 1e-9)
    beyond = np.clip(np.maximum(low - value, value - high) / margin, 0.0, 1.0)
    return np.asarray(1.0 - beyond**2 * (3.0 - 2.0 * beyond))
