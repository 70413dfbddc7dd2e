"""Parameters of the three-legged truth machines: Orthoglide (3-PRPaR), REF-PUU (3-PUU), linear delta.  mm, N, rad."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from tests.validation.plants.rotations import turn


def beam(length: float, young: float, shear: float, area: float, iy: float, iz: float, torsion: float) -> np.ndarray:
    """Tip stiffness (6, 6) of an Euler-Bernoulli cantilever along local x."""
    k = np.zeros((6, 6))
    k[0, 0] = young * area / length
    k[1, 1], k[2, 2] = 12 * young * iz / length**3, 12 * young * iy / length**3
    k[3, 3], k[4, 4], k[5, 5] = shear * torsion / length, 4 * young * iy / length, 4 * young * iz / length
    k[1, 5] = k[5, 1] = -6 * young * iz / length**2
    k[2, 4] = k[4, 2] = 6 * young * iy / length**2
    return k


# local -> machine, per leg of a machine whose slides are the axes
CYCLES = np.stack([np.eye(3), np.roll(np.eye(3), 1, axis=0), np.roll(np.eye(3), 2, axis=0)])


@dataclass(frozen=True)
class Legs:
    """Everything the energy of a three-legged machine depends on; tuples are per leg x, y, z.

    In the local axes of a leg its passive hinge is z, the parallelogram's y, and its bars lie along x where both are 0.
    """

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
    axes: np.ndarray = field(default_factory=lambda: CYCLES)  # (3, 3, 3) local -> machine
    slide: tuple[float, float, float] = (1.0, 0.0, 0.0)  # direction of the actuator, local axes
    stand: tuple[float, float, float] | None = None  # carriage at 0, local axes; None: -offset along x

    @property
    def feet(self) -> np.ndarray:
        """Carriage (3,) at 0 in local axes."""
        return np.array([-self.offset, 0.0, 0.0] if self.stand is None else self.stand)

    def centres(self, rho: np.ndarray) -> np.ndarray:
        """Points (n, 3, 3), machine frame, about which the platform swings at the length of each leg."""
        local = self.feet + rho[:, :, None] * np.array(self.slide) + [self.offset, 0.0, 0.0]
        return np.einsum("lij,nlj->nli", self.axes, local)


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


def ref_puu(
    *,
    tool: float = 100.0,
    roll_deg: float | tuple[float, ...] = 0.0,
    longer: tuple[float, ...] = (0.0, 0.0, 0.0),
    drive_factor: tuple[float, ...] = (1.0, 1.0, 1.0),
    link_factor: float = 1.0,
) -> Legs:
    """The invented 3-PUU cross-check machine: feet are 60 mm posts, bars two 12 x 24 mm profiles lumped."""
    nominal = 310.25
    foot = np.diag([4.409171e-6, 4.409171e-6, 3.968254e-7, 1.322751e-9, 1.322751e-9, 2.086671e-9])
    foot[0, 4] = foot[4, 0] = 6.613757e-8
    foot[1, 3] = foot[3, 1] = -6.613757e-8
    bar = np.diag([7.694692e-6, 2.057370e-2, 5.143424e-3, 6.210629e-7, 1.603061e-7, 6.412244e-7])
    bar[1, 5] = bar[5, 1] = 9.946993e-5
    bar[2, 4] = bar[4, 2] = -2.486748e-5
    base = np.zeros((3, 6))
    base[:, 3] = np.deg2rad(np.broadcast_to(roll_deg, 3))
    return Legs(
        kind="universal",
        length=tuple(nominal + d for d in longer),  # type: ignore[arg-type]
        drive=tuple(1e4 * f for f in drive_factor),  # type: ignore[arg-type]
        foot=link_factor * np.linalg.inv(foot),
        bar=link_factor * np.linalg.inv(bar),
        offset=31.0,
        tool=tool,
        base=base,
        nominal_length=nominal,
    )


def delta(
    *,
    tool: float = 60.0,
    roll_deg: tuple[float, ...] = (0.0, 0.0, 0.0),
    longer: tuple[float, ...] = (0.0, 0.0, 0.0),
    drive_factor: tuple[float, ...] = (1.0, 1.0, 1.0),
    link_factor: float = 1.0,
) -> Legs:
    """The linear delta: columns at 250 mm, slides upright, bars of 400 mm between carriage and a platform of 50 mm.

    In local axes x points away from the machine's axis, y down, z is the crossbar.
    """
    young, outer, inner = 120000.0, 16.0, 12.0
    second = np.pi / 64 * (outer**4 - inner**4)
    bar = beam(400.0, young, young / 2.6, np.pi / 4 * (outer**2 - inner**2), second, second, 2 * second)
    # the carriage gives way less along its slide, local y
    foot = np.diag(1 / np.array([1e-4, 2e-5, 1e-4, 5e-8, 5e-8, 5e-8]))
    upright = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
    columns = [turn(np.array([0.0, 0.0, angle])) @ upright for angle in np.radians([0.0, 120.0, 240.0])]
    base = np.zeros((3, 6))
    base[:, 4] = -np.deg2rad(roll_deg)
    return Legs(
        kind="parallelogram",
        length=tuple(400.0 + d for d in longer),  # type: ignore[arg-type]
        drive=tuple(5e3 * f for f in drive_factor),  # type: ignore[arg-type]
        foot=link_factor * foot,
        bar=link_factor * bar,
        width=80.0,
        offset=-50.0,
        tool=tool,
        base=base,
        nominal_length=400.0,
        axes=np.stack(columns),
        slide=(0.0, -1.0, 0.0),
        stand=(250.0, -((400.0**2 - 200.0**2) ** 0.5), 0.0),
    )


def with_tool(legs: Legs, tool: float) -> Legs:
    """The same machine with a tool of another length, mm."""
    return replace(legs, tool=tool)
