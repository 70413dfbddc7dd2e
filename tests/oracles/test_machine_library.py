"""Delta and router of config/: formulas of the delta, and the energy plant of serial arms for the router."""

from typing import Any

import numpy as np
import pytest

from camcomp.ground.files import shipped
from camcomp.model.config.load import load_config
from camcomp.model.statics.build import build_robot
from camcomp.model.statics.machine import Machine, build_machine
from camcomp.model.statics.target import correct, settle
from tests.validation.plants.legs import beam
from tests.validation.plants.serial import Joint, Link, Shift, Weight
from tests.validation.plants.serial import settle as minimise

TOWERS = np.radians([0.0, 120.0, 240.0])
OUTWARD = np.stack([np.cos(TOWERS), np.sin(TOWERS)], axis=1)


def machine(name: str) -> tuple[Machine, np.ndarray]:
    """The machine of a shipped config, and its workpiece origin."""
    config = load_config([shipped(f"config/{name}.yaml")])
    built = build_machine(*build_robot(config.robot, config.tool.tip))
    return built, np.asarray(config.workpiece.origin_mm)


def points(origin: np.ndarray, n: int = 25) -> np.ndarray:
    """Tips in a block of 120 x 120 x 70 mm about the program origin."""
    return origin + np.random.default_rng(4).uniform([-60, -60, -20], [60, 60, 50], (n, 3))


def carriages(tip: np.ndarray) -> np.ndarray:
    """Heights (n, 3) of the delta's carriages: bars of 400 mm, 200 mm between column and platform joint at the centre."""
    platform = tip + [0.0, 0.0, 60.0]
    level = 200.0 * OUTWARD[None] - platform[:, None, :2]
    return platform[:, 2:] + np.sqrt(400.0**2 - (level**2).sum(axis=2)) - np.sqrt(400.0**2 - 200.0**2)


def test_delta_inverse_kinematics() -> None:
    delta, origin = machine("delta")
    tips = points(origin)
    _, state = settle(delta, tips, np.zeros((25, 3)))
    assert (state.status == 0).all()
    np.testing.assert_allclose(state.rho_nominal, carriages(tips), atol=1e-6)
    assert (delta.limits[:, 0] < carriages(tips).min(axis=0)).all()
    assert (delta.limits[:, 1] > carriages(tips).max(axis=0)).all()


def test_delta_drives_carry_the_load_by_virtual_work() -> None:
    delta, origin = machine("delta")
    tips = points(origin)
    force = np.array([0.3, -0.5, 0.8])
    _, state = settle(delta, tips, np.tile(force, (25, 1)))
    slope = np.stack([(carriages(tips + h) - carriages(tips - h)) / 2e-4 for h in 1e-4 * np.eye(3)], axis=2)
    expected = -np.linalg.solve(np.swapaxes(slope, 1, 2), np.tile(force, (25, 1))[..., None])[..., 0]
    np.testing.assert_allclose(state.drive, expected, atol=2e-4)


def test_delta_looks_the_same_from_every_column() -> None:
    delta, origin = machine("delta")
    turn = np.array([[OUTWARD[1, 0], -OUTWARD[1, 1], 0], [OUTWARD[1, 1], OUTWARD[1, 0], 0], [0, 0, 1]])
    tips, force = points(origin), np.tile([40.0, -20.0, 10.0], (25, 1))
    here, _ = settle(delta, tips, force)
    there, _ = settle(delta, tips @ turn.T, force @ turn.T)
    np.testing.assert_allclose(there, here @ turn.T, atol=1e-6)


INCH = 25.4
BASE = INCH * np.array([[-22.95, 13.25], [22.95, 13.25], [22.95, 13.25], [0, -26.5], [0, -26.5], [-22.95, 13.25]])
PLATFORM = INCH * np.array(
    [[-1, 11.5], [1, 11.5], [10.459, -4.884], [9.459, -6.616], [-9.459, -6.616], [-10.459, -4.884]]
)  # LinuxCNC, src/emc/kinematics/genhexkins.h


def legs(tip: np.ndarray) -> np.ndarray:
    """From base to platform joint (n, 6, 3) of the upright hexapod."""
    centre = tip + [0.0, 0.0, 100.0]
    level = centre[:, None, :2] + PLATFORM - BASE
    return np.concatenate((level, np.repeat(centre[:, None, 2:], 6, axis=1)), axis=2)


def test_hexapod_inverse_kinematics() -> None:
    hexapod, origin = machine("hexapod")
    tips = points(origin)
    _, state = settle(hexapod, tips, np.zeros((25, 3)))
    assert (state.status == 0).all()
    np.testing.assert_allclose(state.rho_nominal, np.linalg.norm(legs(tips), axis=2), atol=1e-6)
    assert (hexapod.limits[:, 0] < state.rho_nominal.min(axis=0)).all()
    assert (hexapod.limits[:, 1] > state.rho_nominal.max(axis=0)).all()


def test_hexapod_gives_way_as_six_springs_along_its_legs() -> None:
    """To first order: rates of the legs J, leg stiffness k in series, deflection (J' k J)^-1 wrench."""
    hexapod, origin = machine("hexapod")
    tips = points(origin)
    force = np.array([60.0, -90.0, 40.0])
    loaded, state = settle(hexapod, tips, np.tile(force, (25, 1)))
    along = legs(tips) / np.linalg.norm(legs(tips), axis=2, keepdims=True)
    arm = np.concatenate((PLATFORM, np.zeros((6, 1))), axis=1)
    rates = np.concatenate((along, np.cross(arm[None], along)), axis=2)
    wrench = np.concatenate((force, np.cross([0.0, 0.0, -100.0], force)))
    k = 1.0 / (1.0 / 5.0e4 + 1.5e-5)
    twist = np.linalg.solve(k * np.swapaxes(rates, 1, 2) @ rates, np.tile(wrench, (25, 1))[..., None])[..., 0]
    moved = twist[:, :3] + np.cross(twist[:, 3:], [0.0, 0.0, -100.0])
    np.testing.assert_allclose(loaded - tips, moved, rtol=2e-3, atol=2e-6)
    pushed = -np.linalg.solve(np.swapaxes(rates, 1, 2), np.tile(wrench, (25, 1))[..., None])[..., 0]
    np.testing.assert_allclose(state.drive, pushed, atol=0.05)


def test_router_bends_as_the_energy_plant_says() -> None:
    router, origin = machine("router")
    tips = points(origin)
    force = np.random.default_rng(5).uniform(-150, 150, tips.shape)
    legs = beam(250, 70000, 70000 / 2.66, 6000, 1.125e7, 2.0e5, 8.98e7)
    right = np.pi / 2

    def diagonal(*compliance: float) -> Link:
        return Link(np.diag(1 / np.array(compliance)))

    arm: list[Any] = [
        Joint("slide", 0, 3e3), Shift((0, 200, 250), (0, -right, 0)), Link(legs), Shift((0, 0, 0), (0, right, 0)),
        diagonal(5e-5, 1e-5, 1e-4, 2e-8, 1e-7, 2e-8), Weight(90), Shift((0, -200, 0)),
        Joint("slide", 1, 4e3), Joint("slide", 2, 6e3), Shift((0, 0, -250)),
        diagonal(1e-4, 8e-5, 1e-5, 5e-8, 5e-8, 3e-8), Weight(40, (0, 0, 80)), Shift((0, 0, -40)),
    ]  # fmt: skip
    loaded, state = settle(router, tips, force)
    np.testing.assert_allclose(state.rho_nominal, tips + [0, 0, 40], atol=1e-9)
    truth = minimise(arm, tips + [0, 0, 40], force)
    assert np.abs(truth.tip - tips).max() > 1.0  # a soft gantry is what the config is for
    np.testing.assert_allclose(loaded, truth.tip, atol=2e-4)
    np.testing.assert_allclose(state.drive, truth.drive, atol=0.1)


@pytest.mark.parametrize("name", ["delta", "router"])
def test_the_correction_brings_the_loaded_tip_home(name: str) -> None:
    built, origin = machine(name)
    tips, force = points(origin), np.tile([-200.0, 30.0, -20.0], (25, 1))
    before, _ = settle(built, tips, force)
    correction = correct(built, tips, force)
    after, _ = settle(built, correction.commanded, force)
    assert (correction.status == 0).all()
    assert np.linalg.norm(before - tips, axis=1).min() > 0.05
    np.testing.assert_allclose(after, tips, atol=1e-6)
