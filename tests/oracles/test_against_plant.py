"""The loaded equilibrium of the package against the energy plant, which shares no code with it."""

import numpy as np
import pytest

from camcomp.model.config.load import load_config
from camcomp.model.job import Job
from camcomp.model.statics.target import correct, settle
from tests.validation.plants import energy
from tests.validation.plants.legs import orthoglide, ref_puu

TIP_MM = 2e-4  # 0.2 um
DRIVE_N = 0.1
MACHINES = {
    "orthoglide": ("config/orthoglide.yaml", lambda: orthoglide()),
    "orthoglide-1deg": ("config/orthoglide-1deg.yaml", lambda: orthoglide(roll_deg=1.0)),
    "puu": ("config/puu.yaml", lambda: ref_puu()),
}


def workspace():
    """Platform references over the cube between Q1 and Q2, and circles about Q0, Q1 and Q2."""
    corners = np.array([[x, y, z] for x in (-73.2, 126.7) for y in (-73.2, 126.7) for z in (-73.2, 126.7)])
    inner = np.random.default_rng(4).uniform(-73.0, 126.0, (40, 3))
    phi = np.linspace(0.0, 2 * np.pi, 24, endpoint=False)
    ring = np.column_stack((np.cos(phi), np.sin(phi), 0 * phi))
    circles = [np.full(3, q) + r * ring for q in (0.0, -73.205, 110.0) for r in (1.0, 25.0)]
    return np.vstack([corners, inner, *circles])


def loads(n):
    """Seed force turned all round, in every direction of feed."""
    phi = np.linspace(0.0, 20 * np.pi, n, endpoint=False)
    c, s = np.cos(phi), np.sin(phi)
    return np.column_stack((215 * c + 10 * s, 215 * s - 10 * c, np.full(n, -25.0)))


@pytest.mark.parametrize("name", MACHINES)
@pytest.mark.parametrize("loaded", [False, True])
def test_loaded_tip_and_drive_forces(name, loaded):
    config, plant = MACHINES[name]
    job, legs = Job(load_config([config])), plant()
    reference = workspace() if name != "puu" else 0.9 * workspace()
    tip = reference + [0.0, 0.0, -100.0]
    force = loads(len(tip)) if loaded else np.zeros((len(tip), 3))
    mine, state = settle(job.machine, tip, force)
    truth = energy.settle(legs, energy.inverse(legs, tip), force)
    assert (state.status == 0).all()
    assert np.abs(mine - truth.tip).max() < TIP_MM
    assert np.abs(state.drive - truth.drive).max() < DRIVE_N
    np.testing.assert_allclose(state.rho, energy.inverse(legs, tip), atol=1e-7)


@pytest.mark.parametrize("name", MACHINES)
def test_corrected_commands_bring_the_plant_s_tip_to_the_target(name):
    config, plant = MACHINES[name]
    job, legs = Job(load_config([config])), plant()
    tip = 0.9 * workspace() + [0.0, 0.0, -100.0]
    force = loads(len(tip))
    correction = correct(job.machine, tip, force)
    truth = energy.settle(legs, energy.inverse(legs, correction.commanded), force)
    assert np.abs(truth.tip - tip).max() < TIP_MM
    assert np.abs(truth.drive - correction.drive).max() < DRIVE_N
