"""Static poses of arms that give way under measured torques or at their base, or have a link that grows; own plants."""

import numpy as np
import pytest
import yaml
from scipy.spatial.transform import Rotation

from camcomp.diagnosis.arm.poses import Poses
from camcomp.diagnosis.arm.study import studied
from camcomp.diagnosis.model.noise import StatedDeviation
from camcomp.model.config.load import load_config
from camcomp.model.statics.build import build_robot
from tests.validation.plants import bodies
from tests.validation.poses.arm import ROOT, Off, load_arm
from tests.validation.poses.plant import poses

SD = 0.02  # mm
MIDDLE = np.radians([0.0, -60.0, 90.0, 0.0, 45.0, 0.0])
ONLY = ("joint_curve", "disturbance", "link_geometry")  # effects that these tests do without, for their time


def robot(folder, masses):
    """The UR10 of the shipped machine file, with or without its masses and springs."""
    content = yaml.safe_load((ROOT / "config" / "ur10.yaml").read_text())
    for joint in content["robot"]["joints"]:
        for key in () if masses else ("mass_kg", "centre_mm"):
            joint.pop(key, None)
    path = folder / "arm.yaml"
    path.write_text(yaml.safe_dump(content))
    return build_robot(load_config([path]).robot, [0.0, 0.0, 0.0])[0]


def campaign(name, seed, off, grown=lambda off, warm: off, torques=False):
    """Sixty poses in an hour, warm from 20 to 26 deg C; every row stands as its own arm."""
    arm, rng = load_arm("ur10"), np.random.default_rng(seed)
    q, time = poses(arm, "joints", 60, rng), 60.0 * np.arange(60)
    warm = 6.0 * (1.0 - np.exp(-time / 1200.0))
    stands = [arm.stand(q[[k]], grown(off.copy(), warm[k])) for k in range(len(q))]
    tip = np.concatenate([s.point + s.turn @ [20.0, 40.0, -90.0] for s in stands]) + SD * rng.standard_normal((60, 3))
    torque = -np.concatenate([s.load for s in stands]) if torques else None
    return Poses(label=name, q=q, tip=tip, time=time, temperature=20.0 + warm, run=np.full(60, name), torque=torque)


def test_measured_torques_find_a_soft_joint_of_an_arm_without_masses(tmp_path):
    off = Off.nothing()
    off.compliance[1] = 3e-9
    runs = [campaign("a", 1, off, torques=True), campaign("b", 2, off, torques=True)]
    result, notes = studied(robot(tmp_path, False), (), runs, without=ONLY, stated=StatedDeviation(SD))
    (cause,) = result.causes
    assert (cause.effect, cause.target) == ("gravity_compliance", "shoulder_lift")
    found = cause.parameters["compliance_rad_per_Nmm"]
    assert found.ci95[0] < 3e-9 < found.ci95[1] and found.value == pytest.approx(3e-9, rel=0.05)
    assert not any("mass_kg" in note for note in notes)


def test_without_masses_and_torques_it_says_that_weight_shows_nothing(tmp_path):
    off = Off.nothing()
    off.compliance[1] = 3e-9
    runs = [campaign("a", 1, off), campaign("b", 2, off)]
    result, notes = studied(robot(tmp_path, False), (), runs, without=ONLY, stated=StatedDeviation(SD))
    assert any("no mass_kg in the machine file" in note for note in notes)
    assert all(cause.effect != "gravity_compliance" for cause in result.causes)


def test_a_link_that_grows_is_named(tmp_path):
    def grown(off, warm):
        off.length[1] += 0.05 * warm
        return off

    runs = [campaign("a", 1, Off.nothing(), grown), campaign("b", 2, Off.nothing(), grown)]
    result, _ = studied(robot(tmp_path, True), (), runs, without=ONLY, stated=StatedDeviation(SD))
    (cause,) = result.causes
    assert (cause.effect, cause.target) == ("link_growth", "shoulder_lift")
    found = cause.parameters["growth_mm_per_K"]
    assert found.ci95[0] < 0.05 < found.ci95[1]


def test_a_carriage_that_turns_more_easily_one_way_is_named(tmp_path):
    content = yaml.safe_load((ROOT / "config" / "kuka-kr210.yaml").read_text())
    for joint in content["robot"]["joints"]:
        joint.pop("stiffness_Nmm_per_rad")  # the plant's joints are rigid
    (tmp_path / "arm.yaml").write_text(yaml.safe_dump(content))
    arm = build_robot(load_config([tmp_path / "arm.yaml"]).robot, [0.0, 0.0, 0.0])[0]
    soft = 1e-12 * np.array([[150.0, 20.0, 0.0], [20.0, 60.0, 0.0], [0.0, 0.0, 0.0]])
    rng, runs = np.random.default_rng(1), []
    for name in "ab":  # parked twice
        q = MIDDLE + rng.uniform(-0.6, 0.6, (60, 6))
        parked = Rotation.from_euler("z", rng.uniform(-3.0, 3.0))
        seen = parked.apply([bodies.on_pedestal(each, np.zeros(3), soft, 0.0) for each in q])
        tip = seen + rng.uniform(-2e3, 2e3, 3) + SD * rng.standard_normal((60, 3))
        runs.append(Poses(label=name, q=q, tip=tip, time=60.0 * np.arange(60), temperature=None, run=np.full(60, name)))
    result, _ = studied(arm, (), runs, without=ONLY, stated=StatedDeviation(SD))
    (cause,) = result.causes
    assert (result.verdict, cause.effect) == ("identified", "base_compliance")
    for name, want in (("difference_rad_per_Nmm", 45e-12), ("cross_rad_per_Nmm", 20e-12)):
        assert cause.parameters[name].ci95[0] < want < cause.parameters[name].ci95[1], name
