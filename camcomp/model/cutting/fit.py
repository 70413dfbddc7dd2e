"""Cutting coefficients from measured mean forces of slots at several feeds per tooth (Altintas, section 2.7.1)."""

import numpy as np
from numpy.typing import ArrayLike

from camcomp.ground.datatypes import Floats
from camcomp.ground.errors import ConfigError
from camcomp.ground.records import dataclass


@dataclass(frozen=True, eq=False)
class SlotFit:
    """Coefficients in the order tangential, radial, axial, and the three straight lines they come from.

    The lines are mean force over feed per tooth, in the order left of the feed, along the feed, down the tool.
    """

    cutting: Floats  # (3,) Ktc, Krc, Kac in N/mm2
    edge: Floats  # (3,) Kte, Kre, Kae in N/mm
    slope: Floats  # (3,) N/mm
    intercept: Floats  # (3,) N
    r2: Floats  # (3,) share of the variance that the line explains; NaN for a force that does not vary

    def params(self) -> dict[str, float]:
        """The keys of `process: force: {model: mechanistic}`."""
        names = ("Kt", "Kr", "Ka")
        cutting = {f"{name}c_N_per_mm2": float(k) for name, k in zip(names, self.cutting, strict=True)}
        return cutting | {f"{name}e_N_per_mm": float(k) for name, k in zip(names, self.edge, strict=True)}


def fit_slot(chip: ArrayLike, force: ArrayLike, *, depth_mm: float, teeth: int, clockwise: bool = True) -> SlotFit:
    """Least squares of mean slot forces on the tool, (Fr, Ft, Fz) (k, 3) in N, over the feed per tooth (k,) in mm.

    For scripts that evaluate dynamometer tests and write their own YAML. A dynamometer under the work measures the
    opposite force: change all signs first.

    Raises:
        ConfigError: CC265, fewer than two different feeds, or values that are not finite or not positive.
    """
    c, f = np.asarray(chip, float), np.asarray(force, float)
    if c.ndim != 1 or f.shape != (c.size, 3) or not (np.isfinite(c).all() and np.isfinite(f).all()):
        raise ConfigError(
            "CC265", f"the fit needs k feeds and k rows of Fr, Ft, Fz, finite; not {c.shape} and {f.shape}"
        )
    if c.size < 2 or not np.ptp(c) > 0 or not (c > 0).all():
        raise ConfigError("CC265", "the fit needs at least two different feeds per tooth above zero")
    if teeth < 1 or not depth_mm > 0:
        raise ConfigError("CC265", "the fit needs at least one tooth and a depth above zero")
    side = -1.0 if clockwise else 1.0
    measured = f * [side, 1.0, -1.0]
    design = np.stack([c, np.ones_like(c)], axis=1)
    (slope, intercept), *_ = np.linalg.lstsq(design, measured, rcond=None)
    rest = ((measured - design @ np.stack([slope, intercept])) ** 2).sum(axis=0)
    total = ((measured - measured.mean(axis=0)) ** 2).sum(axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        r2 = np.where(total > 0, 1.0 - rest / total, np.nan)
    edges = teeth * depth_mm
    left, along, down = slope
    left0, along0, down0 = intercept
    return SlotFit(
        cutting=np.array([4 * left, -4 * along, np.pi * down]) / edges,
        edge=np.array([np.pi * left0, -np.pi * along0, 2 * down0]) / edges,
        slope=slope,
        intercept=intercept,
        r2=r2,
    )
