"""Parameters of the three-legged truth machines: Orthoglide (3-PRPaR) and REF-PUU (3-PUU).  mm, N, rad."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np


def beam(length: float, young: float, shear: float, area: float, iy: float, iz: float, torsion: float) -> np.ndarray:
    """Tip stiffness (6, 6) of an Euler-Bernoulli cantilever along local x."""
    k = np.zeros((6, 6))
    k[0, 0] = young * area / length
    k[1, 1], k[2, 2] = 12 * young * iz / length**3, 12 * young * iy / length**3
    k[3, 3], k[4, 4], k[5, 5] = shear * torsion / length, 4 * young * iy / length, 4 * young * iz / length
    k[1, 5] = k[5, 1] = -6 * young * iz / length**2
    k[2, 4] = k[4, 2] = 6 * young * iy / length**2
    return k


@dataclass(frozen=True)
class Legs:
    """Everything the energy of a three-legged machine depends on; tuples are per leg x, y, z."""

    kind: str  # "parallelogram" or "universal"
    length: tuple[float, float, float]
    drive: tuple[float, float, float]  # N/mm
    foot: np.ndarray  # (6, 6) stiffness
    bar: np.ndarray  # (6, 6) stiffness of one bar (parallelogram) or of the lumped bar (universal)
    width: float = 0.0  # distance of the two bars of a parallelogram
    offset: float = 0.0  # platform offset along the leg's actuator axis, cancelled by the carriage offset
    tool: float = 0.0  # tool length along -z
    base: np.ndarray = field(default_factory=lambda: np.zeros((3, 6)))  # base error per leg, local axes
    end: np.ndarray = field(default_factory=lambda: np.zeros((3, 6)))  # end error per leg, local axes
    nominal_length: float = 0.0  # what the controller believes


def orthoglide(
    *,
    tool: float = 100.0,
    roll_deg: float | tuple[float, float, float] = 0.0,
    longer: tuple[float, float, float] = (0.0, 0.0, 0.0),
    drive_factor: tuple[float, float, float] = (1.0, 1.0, 1.0),
    link_factor: float | tuple[float, float, float] = 1.0,
) -> Legs:
    """The reference Orthoglide.  roll_deg: base roll about the actuator axis; longer: mm added to each leg.

    A stiffer or softer drive or link is a factor.  One link factor multiplies feet and bars of every leg.
    """
    nominal, side, young = 310.583, 15.0, 70000.0
    second = side**4 / 12
    bar = beam(nominal, young, young / (2 * 1.33), side**2, second, second, 0.141 * side**4)
    foot = np.diag(1 / np.array([1.5e-4, 1.0e-4, 1.0e-4, 1.0e-7, 2.0e-7, 2.0e-7]))
    base = np.zeros((3, 6))
    base[:, 3] = np.deg2rad(np.broadcast_to(roll_deg, 3))
    factor = np.broadcast_to(np.asarray(link_factor, float), 3)
    return Legs(
        kind="parallelogram",
        length=tuple(nominal + d for d in longer),  # type: ignore[arg-type]
        drive=tuple(1e4 * f for f in drive_factor),  # type: ignore[arg-type]
        foot=factor[:, None, None] * foot,
        bar=factor[:, None, None] * bar,
        width=80.0,
        tool=tool,
        base=base,
        nominal_length=nominal,
    )


def ref_puu(*, tool: float = 100.0, roll_deg: float = 0.0) -> Legs:
    """The invented 3-PUU cross-check machine: feet are 60 mm posts, bars two 12 x 24 mm profiles lumped."""
    nominal = 310.25
    foot = np.diag([4.409171e-6, 4.409171e-6, 3.968254e-7, 1.322751e-9, 1.322751e-9, 2.086671e-9])
    foot[0, 4] = foot[4, 0] = 6.613757e-8
    foot[1, 3] = foot[3, 1] = -6.613757e-8
    bar = np.diag([7.694692e-6, 2.057370e-2, 5.143424e-3, 6.210629e-7, 1.603061e-7, 6.412244e-7])
    bar[1, 5] = bar[5, 1] = 9.946993e-5
    bar[2, 4] = bar[4, 2] = -2.486748e-5
    base = np.zeros((3, 6))
    base[:, 3] = np.deg2rad(roll_deg)
    return Legs(
        kind="universal",
        length=(nominal,) * 3,
        drive=(1e4,) * 3,
        foot=np.linalg.inv(foot),
        bar=np.linalg.inv(bar),
        offset=31.0,
        tool=tool,
        base=base,
        nominal_length=nominal,
    )


def with_tool(legs: Legs, tool: float) -> Legs:
    """The same machine with a tool of another length, mm."""
    return replace(legs, tool=tool)
