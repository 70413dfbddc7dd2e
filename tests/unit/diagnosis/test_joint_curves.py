"""Joints of an arm that turn unevenly, stop short or are dragged along: found on poses of the energy plant, or not."""

import io
from dataclasses import replace

import numpy as np
import pytest
from ruamel.yaml import YAML

from camcomp.diagnosis.arm.curves import covered, seen_angles
from camcomp.diagnosis.arm.poses import Poses, approached
from camcomp.diagnosis.model.noise import StatedDeviation
from camcomp.diagnosis.result.types import CurveCause
from camcomp.model.config.load import load_config
from camcomp.model.config.write_back import with_causes
from camcomp.model.statics.build import build_robot
from tests.studies import arm_study
from tests.validation.plants.arm_poses import measured

STATED = StatedDeviation(tip_mm=0.02)
FLOOR_UM = 20.0 * np.sqrt(3.0)
LIFT, COUNT = 1, 250
A, B = ([-2, -2.5, -2, -3, -2, -3], [1, -0.3, 2, 3, 2, 3]), ([-1, -1.8, -1, -2, -1, -2], [2, -0.4, 1.5, 1, 2.5, 2])


def uneven(angle):
    """Error of the joint, rad: what a gear with 2 and 17 waves per turn does."""
    return 1.5e-4 * np.sin(17.0 * angle + 0.4) + 1e-4 * np.cos(2.0 * angle)


def poses(name, seed, ranges, fault):
    q = np.random.default_rng(seed).uniform(*ranges, (COUNT, 6))
    time = np.arange(float(COUNT))
    return Poses(
        label=name,
        q=q,
        tip=measured(q, seed, error=fault(q)),
        time=time,
        temperature=None,
        run=np.full(COUNT, name),
        sd=None,
        row=None,
        approach=approached(q, time),
    )


def at_lift(error):
    return np.outer(error, np.eye(6)[LIFT])


@pytest.fixture(scope="module")
def robot():
    return build_robot(load_config(["config/ur10.yaml"]).robot, [0.0, 0.0, 0.0])[0]


@pytest.fixture(scope="module")
def runs():
    return [poses(name, k, r, lambda q: at_lift(uneven(q[:, LIFT]))) for name, k, r in (("A", 1, A), ("B", 2, B))]


@pytest.fixture(scope="module")
def result(robot, runs):
    return arm_study(robot, (), runs, holdout=["B"], stated=STATED)


def test_an_uneven_joint_is_found_with_its_curve(result):
    assert [(c.effect, c.target) for c in result.known] == [("joint_curve", "shoulder_lift")]
    assert result.shrinkage.before_rms_um > 4.0 * FLOOR_UM
    assert result.shrinkage.after_rms_um < 1.4 * FLOOR_UM
    assert result.shrinkage.ci95[0] < result.shrinkage.ratio < result.shrinkage.ci95[1]


def test_the_band_of_a_curve_holds_the_truth_and_is_wide_where_no_pose_was(result):
    curve = result.known[0].curve
    angle, error, sd = (np.array(each) for each in (curve.angle_deg, curve.error_rad, curve.sd_rad))
    inside = covered({0: curve.seen_deg}, np.radians(angle)[:, None])
    truth = uneven(np.radians(angle))
    off = (error - truth)[inside] / sd[inside]
    off = off - np.mean(off / sd[inside]) / np.mean(1.0 / sd[inside])  # a constant is the frame's, or another joint's
    assert np.mean(np.abs(off) < 1.96) > 0.85
    low, high = np.degrees([A[0][LIFT], A[1][LIFT]])
    far = ((angle - high) % 360.0 > 12.0) & ((angle - high) % 360.0 < 360.0 - (high - low) - 12.0)
    assert (error[far] == 0.0).all()
    assert np.min(sd[far]) > 4.0 * np.median(sd[inside])
    assert curve.seen_share == pytest.approx((high - low) / 360.0, abs=0.03)


def test_what_is_written_into_the_machine_file_is_the_curve_that_was_found(robot, runs, result, tmp_path):
    assert isinstance(result.known[0], CurveCause)
    text = with_causes("effects: []\n", result.known)
    entry = YAML(typ="safe").load(io.StringIO(text))["effects"][0]
    (tmp_path / "found.yaml").write_text(text)
    config = load_config(["config/ur10.yaml", tmp_path / "found.yaml"])
    values = config.effects[0].values
    assert len(values["sine"]) == len(values["cosine"]) == 40 and len(values["band_rad"]) == 120
    angle = np.radians(np.array(result.known[0].curve.angle_deg))
    inside = covered({0: entry["seen_deg"]}, angle[:, None])
    k = np.arange(1, 41)[:, None]
    plain = values["amplitude_rad"] * (values["sine"] @ np.sin(k * angle) + values["cosine"] @ np.cos(k * angle))
    np.testing.assert_allclose(plain[inside], np.array(result.known[0].curve.error_rad)[inside], atol=2e-7)


@pytest.mark.campaign  # an uneven joint is in the plain run
def test_unseen_poses_at_angles_without_a_curve_are_told_apart(robot, runs):
    narrow = [runs[0].take(runs[0].q[:, LIFT] < -1.2), runs[1]]
    result = arm_study(robot, (), narrow, holdout=["B"], stated=STATED)
    shrunk = result.shrinkage
    assert 0.2 < shrunk.covered_share < 0.6
    assert shrunk.covered_rms_um < 1.5 * FLOOR_UM < shrunk.after_rms_um


@pytest.mark.campaign
def test_one_campaign_does_not_identify_a_curve(robot, runs):
    result = arm_study(robot, (), runs[:1], stated=STATED)
    assert result.verdict == "ambiguous"
    assert result.shrinkage is None


@pytest.mark.campaign  # as 23007 of the foreign poses
def test_a_joint_that_stops_short_is_found_from_the_way_in_which_it_came(robot):
    def short(q):
        way = np.sign(np.diff(q[:, 2], prepend=q[0, 2]))
        return np.outer(-1.5e-4 * way, np.eye(6)[2])

    runs = [poses(name, k, r, short) for name, k, r in (("A", 3, A), ("B", 4, B))]
    result = arm_study(robot, (), runs, holdout=["B"], stated=STATED)
    assert [(c.effect, c.target) for c in result.known] == [("joint_hysteresis", "elbow")]
    width = result.known[0].parameters["width_rad"]
    assert width.value == pytest.approx(3e-4, rel=0.05)
    assert width.ci95[1] - width.ci95[0] < 5e-5  # beside small errors of everything else, as every arm has them
    blind = [replace(r, approach=None) for r in runs]  # poses without an order say nothing of it
    result = arm_study(robot, (), blind, holdout=["B"], stated=STATED)
    assert result.verdict == "unknown"
    assert "joint_hysteresis" not in {c.effect for c in result.known}


@pytest.mark.campaign
def test_a_wrist_joint_that_is_dragged_along_is_found(robot):
    runs = [poses(n, k, r, lambda q: np.outer(4e-4 * q[:, 3], np.eye(6)[4])) for n, k, r in (("A", 5, A), ("B", 6, B))]
    result = arm_study(robot, (), runs, holdout=["B"], stated=STATED)
    assert [(c.effect, c.target) for c in result.known] == [("joint_coupling", "wrist_2")]
    assert result.known[0].parameters["factor"].value == pytest.approx(4e-4, rel=0.1)


def test_intervals_that_poses_have_seen_go_round_the_turn():
    angle = np.radians([*np.arange(170.0, 190.0, 2.0), *np.arange(-60.0, -40.0, 5.0), 710.0])
    assert seen_angles(angle) == ((-60.0, -45.0), (-10.0, -10.0), (170.0, 188.0))
    assert seen_angles(np.radians(np.arange(0.0, 360.0, 5.0))) == ((-180.0, 180.0),)
    inside = covered({0: [(170.0, 188.0)]}, np.radians([[-175.0], [175.0], [535.0], [189.0]]))
    assert inside.tolist() == [True, True, True, False]


def test_the_way_of_a_joint_is_that_of_its_last_turn():
    q = np.array([[0.0], [0.5], [0.5], [0.2], [0.9]])
    assert approached(q, np.arange(5.0))[:, 0].tolist() == [0.0, 1.0, 1.0, -1.0, 1.0]
    assert approached(q[::-1], np.arange(5.0)[::-1])[::-1, 0].tolist() == [0.0, 1.0, 1.0, -1.0, 1.0]
    assert not approached(q, np.zeros(5)).any()
