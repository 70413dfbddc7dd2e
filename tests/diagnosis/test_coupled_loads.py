"""Loops of an arm without an integrator give way to the weight and the inertia of all its bodies, through the motion of all joints.

The plant integrates the equations of two links in a vertical plane (Siciliano et al., Robotics, 7.3.2) with a position and a speed
controller per joint; it imports nothing of camcomp.
"""

import json

import numpy as np
import pytest

from camcomp.api.diagnosis import diagnose
from camcomp.diagnosis.studies import checked_axes, open_logs
from camcomp.model.config.load import read_experiment

LENGTH, CENTRES, MASSES = 0.6, (0.4, 0.3), (30.0, 20.0)  # m of the upper arm, m from the joints, kg
KP, KV = 12.0, np.array([900.0, 160.0])  # 1/s, N m s/rad
G = 9.80665
RUNS = ("first", "second", "unseen")
SETTLED_S = 2.0  # from the start at rest
ROBOT = {
    "name": "two links",
    "type": "serial",
    "convention": "dh",
    "joints": [
        {"name": "A1", "alpha_deg": 90},
        {"name": "A2", "a_mm": 600, "mass_kg": MASSES[0], "centre_mm": [-200, 0, 0]},
        {"name": "A3", "a_mm": 500, "mass_kg": MASSES[1], "centre_mm": [-200, 0, 0]},
    ],
}


def forces(q, w):
    """Inertia (2, 2) kg m2, and torque (2,) N m of weight and of speeds."""
    (c1, c2), (m1, m2) = CENTRES, MASSES
    pull, turn = m2 * LENGTH * c2 * np.cos(q[1]), m2 * LENGTH * c2 * np.sin(q[1])
    both = m2 * c2**2 + pull
    inertia = np.array([[m1 * c1**2 + m2 * (LENGTH**2 + c2**2) + 2.0 * pull, both], [both, m2 * c2**2]])
    outer = m2 * G * c2 * np.cos(q[0] + q[1])
    weight = np.array([(m1 * c1 + m2 * LENGTH) * G * np.cos(q[0]) + outer, outer])
    return inertia, weight + turn * np.array([-2.0 * w[0] * w[1] - w[1] ** 2, w[0] ** 2])


def log(seed, until=10.0, step=1e-4):
    """Times, set-points and encoders (n, 5) in s and rad, at 125 Hz."""
    rng, t = np.random.default_rng(seed), np.arange(0.0, until, step)
    waves = [[(rng.uniform(0.2, 0.5) / k, 0.8 * k, rng.uniform(0.0, 6.0)) for k in range(1, 5)] for _ in KV]
    x = np.array([0.8, -1.0]) + np.transpose([sum(a * np.sin(w * t + p) for a, w, p in own) for own in waves])
    q, w, rows = x[0].copy(), np.zeros(2), np.zeros_like(x)
    for i, asked in enumerate(x):
        inertia, load = forces(q, w)
        w = w + step * np.linalg.solve(inertia, KV * (KP * (asked - q) - w) - load)
        q = q + step * w
        rows[i] = q
    return np.column_stack([t, x, rows + 2e-6 * rng.standard_normal(rows.shape)])[::80]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("arm")
    header = "t_s,cmd_A2_rad,cmd_A3_rad,act_A2_rad,act_A3_rad"
    for seed, name in enumerate(RUNS):
        np.savetxt(path / f"{name}.csv", log(seed), fmt="%.9g", delimiter=",", comments="", header=header)
    return path


def experiment(folder, effects):
    """File of an experiment with the runs, and a machine file with effects."""
    machine = {"robot": ROBOT, "tool": {"length_mm": 0}, "workpiece": {"origin_mm": [700, 0, 300]}, "effects": effects}
    (folder / "arm.yaml").write_text(json.dumps(machine))
    runs = [{"name": name, "log": f"{name}.csv", "cutting": False} for name in RUNS]
    (folder / "e.yaml").write_text(json.dumps({"config": ["arm.yaml"], "runs": runs, "holdout": ["unseen"]}))
    return folder / "e.yaml"


def residuals_mrad(file):
    """Following errors (rms) of A2 and A3 in the unseen run behind the effects of the machine file."""
    axes = checked_axes(open_logs(read_experiment(file)))
    runs = [axes[name][RUNS.index("unseen")] for name in ("A2", "A3")]
    return np.array([np.sqrt(np.mean(run.gap[run.time > SETTLED_S] ** 2)) for run in runs])


def loops(loads):
    """Loops that are late by their gain, and give way to loads by all of their gains."""
    effects = [{"effect": "servo_lag", "time_constant_ms": 1e3 / KP}]
    for name, gain in zip(("A2", "A3"), KV, strict=True):
        formula = " - ".join(["0", *(f"{1e-3 / (KP * gain)}*{load}" for load in loads)])
        effects.append({"effect": "formula", "stage": "control", "target": name, "formula": formula})
    return effects


def test_a_law_of_the_loads_is_what_all_bodies_do_to_the_loops(folder):
    """Laws take loads where the loops would be without them: 20 mrad off, which is 2 % of the weight."""
    names = ("followed_weight_Nmm", "followed_inertia_Nmm")
    none, weight, both = (residuals_mrad(experiment(folder, loops(some))) for some in ((), names[:1], names))
    assert np.all(none > 15.0)
    assert np.all(weight > 0.05 * none)
    assert np.all(both < 0.02 * none)


def test_the_diagnosis_finds_what_the_loads_of_stated_masses_do_to_the_loops(folder):
    found = diagnose(experiment(folder, []))
    claims = [own.after_rms for own in found.result.shrinkage.actuators.values()]
    assert claims[0] < 50.0 and claims[1] < 400.0  # urad of 40 mrad
    for part, gain in zip(found.result.axis_laws, KV, strict=True):
        size = part.formula.split("*(followed_weight_Nmm + followed_inertia_Nmm)")[0].rsplit(" ", 1)[-1]
        assert float(size) == pytest.approx(1e-3 / (KP * gain), rel=0.06)
    (folder / "written.yaml").write_text(found.machine_with_causes(str(folder / "written.yaml")))
    again = experiment(folder, [])
    again.write_text(again.read_text().replace("arm.yaml", "written.yaml"))
    assert 1e3 * residuals_mrad(again) == pytest.approx(claims, rel=0.25)
