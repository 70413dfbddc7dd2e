"""A force that a dynamometer measured acts as measured: it bends the machine, and errors of a force model do not scale it."""

import numpy as np
import yaml

from camcomp.api.diagnosis import diagnose
from tests.validation.poses.arm import ROOT, load_arm
from tests.validation.poses.plant import poses

STIFFNESS = np.array([20000.0, 20000.0, 40000.0])  # N/mm, drives of config/cartesian.yaml
EFFECTS = [
    {"effect": "cutting_force", "factor": 2.0},
    {"effect": "tool_wear", "growth_per_min": 1.0},
]
ONLY = ("joint_curve", "disturbance", "link_geometry", "formula", "map")
JOINTS = load_arm("kuka-kr210")


def written(folder, config, runs, columns, sd=None, *, effects=EFFECTS, **others):
    """Path of an experiment: runs are (name, rows) without a program."""
    effects_file = folder / "effects.yaml"
    effects_file.write_text(yaml.safe_dump({"effects": effects}))
    for name, rows in runs:
        np.savetxt(folder / f"{name}.csv", rows, delimiter=",", header=",".join(columns), comments="", fmt="%.9g")
    experiment = {
        "config": [str(ROOT / "config" / config), str(effects_file)],
        "runs": [
            {"name": n, "log": f"{n}.csv", "cutting": True, "started_s": 1000.0 * k} for k, (n, _) in enumerate(runs)
        ],
    }
    (folder / "experiment.yaml").write_text(yaml.safe_dump(experiment | ({"sd": sd} if sd else {}) | others))
    return folder / "experiment.yaml"


def slides(seed, channels):
    """Rows of a Cartesian machine on springs, pushed by a changing force for 12 s."""
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, 12.0, 0.1)
    moved = np.stack([30.0 * np.sin(0.5 * t), 30.0 * np.cos(0.7 * t), 5.0 * np.sin(0.3 * t)], axis=1)
    force = np.stack([400.0 * np.sin(0.9 * t), -300.0 + 200.0 * np.cos(1.3 * t), 100.0 * np.sin(2.0 * t)], axis=1)
    tip = moved + force / STIFFNESS + 5e-4 * rng.standard_normal(moved.shape)
    seen = moved + 2e-4 * rng.standard_normal(moved.shape)
    drive = -force + 1.0 * rng.standard_normal(force.shape)
    every = {"t_s": t[:, None], "cmd": moved, "act": seen, "tip": tip, "N": drive, "dyno": force}
    return np.hstack([every[each] for each in channels])


def test_slides_bend_under_the_measured_force(tmp_path):
    channels = ("t_s", "cmd", "tip", "dyno")
    columns = ["t_s", *(f"cmd_{a}_mm" for a in "xyz"), "x_mm", "y_mm", "z_mm", "fx_N", "fy_N", "fz_N"]
    runs = [(f"r{k}", slides(k, channels)) for k in (1, 2)]
    result = diagnose(written(tmp_path, "cartesian.yaml", runs, columns)).result
    assert result.verdict == "none"
    assert result.gap.rms_um < 1.3


def test_drives_of_axis_logs_hold_the_measured_force(tmp_path):
    channels = ("t_s", "cmd", "act", "N", "dyno")
    columns = [
        "t_s", *(f"cmd_{a}_mm" for a in "xyz"), *(f"act_{a}_mm" for a in "xyz"), *(f"act_{a}_N" for a in "xyz"),
        "fx_N", "fy_N", "fz_N",
    ]  # fmt: skip
    runs = [(f"r{k}", slides(k, channels)) for k in (1, 2)]
    result = diagnose(written(tmp_path, "cartesian.yaml", runs, columns)).result
    assert result.verdict == "none"


def test_an_arm_in_poses_bends_under_the_measured_force(tmp_path):
    sd, runs = 0.02, []
    for k in (1, 2):
        rng = np.random.default_rng(k)
        q = poses(JOINTS, "joints", 60, rng)
        stands = JOINTS.stand(q)
        tool = np.array([0.0, 0.0, -JOINTS.tool_mm])
        force = 300.0 * rng.standard_normal((60, 3))
        lever = stands.point + stands.turn @ tool - stands.joint_point
        torque = np.einsum("jni,jni->nj", stands.axis, np.cross(lever, force))
        bent = JOINTS.stand(q + torque / JOINTS.stiffness)
        tip = bent.point + bent.turn @ tool - JOINTS.origin + sd * rng.standard_normal((60, 3))
        runs.append((f"p{k}", np.hstack([60.0 * np.arange(60)[:, None], q, tip, force])))
    columns = ["t_s", *(f"act_{a}_rad" for a in JOINTS.names), "x_mm", "y_mm", "z_mm", "fx_N", "fy_N", "fz_N"]
    path = written(tmp_path, "kuka-kr210.yaml", runs, columns, {"tip_mm": sd})
    result = diagnose(path, without=ONLY).result
    assert result.verdict == "none"
    assert result.gap.rms_um < 40.0
