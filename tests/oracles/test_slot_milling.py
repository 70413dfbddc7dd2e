"""Milling forces against numbers from elsewhere, and against a cutter that is turned tooth by tooth.

Measured: slots by a flat end mill of 25 mm, 2 teeth, 6000 rev/min, 3 mm deep, in a material that is not stated; mean forces
by leekunhwee, ForceCalculation (GitHub, commit 3fda341), in the frame of camcomp.model.cutting.average, axial force counted
down the tool.
"""

from typing import Any

import numpy as np
import pytest

from camcomp.forces import kienzle, mechanistic
from camcomp.model.cutting.cut import Cut
from camcomp.model.cutting.fit import fit_slot

FEED = np.array([300.0, 600.0, 900.0, 1200.0, 1500.0])
LEFT = np.array([63.0, 107.1, 137.7, 171.3, 210.7])
ALONG = np.array([-39.8, -60.1, -71.6, -76.7, -78.5])
DOWN = np.array([55.7, 70.9, 82.6, 85.2, 83.5])
COEFFICIENTS: dict[str, Any] = {
    "Ktc_N_per_mm2": 958.86, "Krc_N_per_mm2": 250.86, "Kac_N_per_mm2": 146.36,
    "Kte_N_per_mm": 15.758, "Kre_N_per_mm": 19.434, "Kae_N_per_mm": 18.207,
}  # fmt: skip


def cut(feed: np.ndarray, speed: float, depth: float, teeth: int, width: float = np.nan, diameter: float = 25.0) -> Cut:
    n = len(feed)
    same = np.ones(n)
    along_x = np.tile([1.0, 0.0, 0.0], (n, 1))
    return Cut(
        tangent=along_x,
        tool_axis=[0, 0, 1],
        feed=feed,
        speed=speed * same,
        depth=depth * same,
        width=width * same,
        arc_length=0 * same,
        line=0 * same,
        diameter_mm=diameter,
        teeth=teeth,
    )


def test_fit_gives_the_published_lines_and_coefficients() -> None:
    fit = fit_slot(FEED / (2 * 6000), np.stack([-LEFT, ALONG, -DOWN], axis=1), depth_mm=3.0, teeth=2)
    # The means are printed to 0.1 N, which moves a slope by up to 1.2 N/mm and an intercept by up to 0.14 N.
    np.testing.assert_allclose(fit.slope, [1438.29, -376.29, 279.53], atol=1.2)
    np.testing.assert_allclose(fit.intercept, [30.095, -37.116, 54.622], atol=0.14)
    np.testing.assert_allclose(fit.r2, [0.997, 0.865, 0.786], atol=1e-3)
    np.testing.assert_allclose(fit.cutting, [958.86, 250.86, 146.36], atol=0.8)
    np.testing.assert_allclose(fit.edge, [15.758, 19.434, 18.207], atol=0.08)


def test_published_lines_give_the_published_coefficients_to_all_digits() -> None:
    # Two exact points of each line leave the least squares nothing to do.
    chip = np.array([0.0, 0.125]) + 1e-3
    lines = np.outer(chip, [-1438.29, -376.29, -279.53]) + [-30.095, -37.116, -54.622]
    fit = fit_slot(chip, lines, depth_mm=3.0, teeth=2)
    np.testing.assert_allclose(fit.cutting, [958.86, 250.86, 146.36], atol=0.005)
    np.testing.assert_allclose(fit.edge, [15.758, 19.434, 18.207], atol=0.0006)


def test_refitted_coefficients_describe_the_measurement_they_come_from() -> None:
    force = mechanistic.force(cut(FEED, 6000, 3.0, 2), mechanistic.Params(**COEFFICIENTS))
    np.testing.assert_allclose(-force[:, 0], LEFT, rtol=0.06)
    np.testing.assert_allclose(force[:, 1], ALONG, atol=8.0)
    np.testing.assert_allclose(-force[:, 2], DOWN, atol=8.0)


def test_half_immersion_up_milling() -> None:
    # Example inputs of yigito2/milling-force-model-altintas (GitHub); x along the feed, y left of it, z the size.
    # 4 teeth, 0.05 mm each: 200 mm/min at 1000 rev/min.
    params = mechanistic.Params(
        Ktc_N_per_mm2=447.88, Krc_N_per_mm2=374.21, Kac_N_per_mm2=97,
        Kte_N_per_mm=70.298, Kre_N_per_mm=12.603, Kae_N_per_mm=0, milling="up",
    )  # fmt: skip
    force = mechanistic.force(cut(np.array([200.0]), 1000, 5.08, 4, width=12.5), params)
    np.testing.assert_allclose(force, [[-213.213, -351.840, -15.685]], atol=6e-4)


@pytest.mark.parametrize(
    ("kc11", "mc", "expected"),
    [
        (641, 0.27, [68.8, 114.0, 153.3, 189.2, 222.6]),  # soft wrought aluminium, FreeCAD
        (700, 0.25, [69.4, 116.8, 158.3, 196.4, 232.2]),  # VDI 3323 group 21
        (800, 0.25, [79.4, 133.5, 180.9, 224.5, 265.4]),  # group 22
    ],
)
def test_kienzle_predicts_the_slots_blindly(kc11: float, mc: float, expected: list[float]) -> None:
    params = kienzle.Params(kc11_N_per_mm2=kc11, mc=mc, radial_ratio=0.3, axial_ratio=0.1)
    force = kienzle.force(cut(FEED, 6000, 3.0, 2), params)
    np.testing.assert_allclose(-force[:, 0], expected, atol=0.06)
    assert (np.abs(-force[:, 0] / LEFT - 1) < 0.32).all()


def turned(
    clockwise: bool, width: float, side: float, chip_law: Any, teeth: int, depth: float, chip: float
) -> np.ndarray:
    """Mean (Fr, Ft, Fz) on the tool: every tooth is put in its place, and pushed by the chip that it meets.

    The tool feeds along +x over the work; side +1 has the wall left of the feed, -1 right, width the strip it cuts.
    """
    radius = 12.5
    forward, up = np.array([1.0, 0, 0]), np.array([0, 0, 1.0])
    left = np.cross(up, forward)
    steps = 100_000
    angle = ((np.arange(steps) + 0.5) * 2 * np.pi / steps)[:, None]
    outward = np.cos(angle) * forward + np.sin(angle) * left
    motion = np.cross(-up if clockwise else up, outward)
    thickness = chip * (outward @ forward)
    cuts = (thickness > 0) & (side * (outward @ left) * radius >= radius - width)
    tangential, radial, axial = (np.where(cuts, part, 0.0)[:, None] for part in chip_law(np.maximum(thickness, 0.0)))
    mean = teeth * depth * (-tangential * motion - radial * outward - axial * up).mean(axis=0)
    right = np.cross(forward, up)
    return np.array([mean @ right, mean @ forward, mean @ up])


@pytest.mark.parametrize("clockwise", [True, False])
@pytest.mark.parametrize(("width", "milling"), [(25.0, "up"), (4.0, "up"), (4.0, "down"), (20.0, "down")])
def test_averages_agree_with_a_cutter_turned_tooth_by_tooth(clockwise: bool, width: float, milling: str) -> None:
    # Up milling enters where the chip is zero: the teeth run forward there, so a clockwise cutter has its wall left.
    side = (1.0 if milling == "up" else -1.0) * (1.0 if clockwise else -1.0)
    spindle = "clockwise" if clockwise else "counterclockwise"
    one = cut(np.array([1200.0]), 6000, 3.0, 2, width=width)

    def linear(h: np.ndarray) -> tuple:
        return 958.86 * h + 15.758, 250.86 * h + 19.434, 146.36 * h + 18.207

    def power(h: np.ndarray) -> tuple:
        tangential = 641 * h**0.73
        return tangential, 0.3 * tangential, 0.2 * tangential

    params = mechanistic.Params(**COEFFICIENTS, milling=milling, spindle=spindle)
    expected = turned(clockwise, width, side, linear, 2, 3.0, 0.1)
    np.testing.assert_allclose(mechanistic.force(one, params)[0], expected, atol=0.02)
    law = kienzle.Params(
        kc11_N_per_mm2=641, mc=0.27, radial_ratio=0.3, axial_ratio=0.2, milling=milling, spindle=spindle
    )
    expected = turned(clockwise, width, side, power, 2, 3.0, 0.1)
    np.testing.assert_allclose(kienzle.force(one, law)[0], expected, atol=0.02)
