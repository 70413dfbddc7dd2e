"""Poses to measure next: as informative as the best that trying all of them finds, and better than chance."""

import json
from itertools import combinations

import numpy as np
import pytest

from camcomp.diagnosis.arm.next_poses import pose_list
from camcomp.diagnosis.arm.poses import ArmBench
from camcomp.diagnosis.model.design import designed
from camcomp.diagnosis.model.folds import without_nuisances
from camcomp.diagnosis.result.types import PosesToMeasure
from tests.commandline import camcomp, table
from tests.validation.measured.test_ur10 import campaigns
from tests.validation.plants.arm_poses import platform

NOISE = 0.05


def information(X, chosen, prior):
    """Half the log det of the posterior's precision over the prior's, bits, written down anew."""
    rows = X[list(chosen)].reshape(-1, X.shape[2]) / NOISE
    return 0.5 * np.linalg.slogdet(np.eye(len(prior)) + prior @ rows.T @ rows)[1] / np.log(2.0)


@pytest.fixture(scope="module")
def rows():
    rng = np.random.default_rng(4)
    return rng.standard_normal((14, 3, 7)) * rng.uniform(0.1, 1.0, (14, 1, 7)), np.diag(rng.uniform(0.1, 2.0, 7))


def test_the_choice_is_as_good_as_the_best_of_all(rows):
    X, prior = rows
    found = designed(X / NOISE, prior, 4)
    assert found.gain == pytest.approx(information(X, found.chosen, prior), rel=1e-6)
    every = [information(X, some, prior) for some in combinations(range(14), 4)]
    assert found.gain > 0.995 * max(every)
    assert found.gain > np.quantile(every, 0.98)
    assert len(set(found.chosen)) == 4


def test_a_list_of_poses_is_written_as_csv_and_as_joints():
    poses = PosesToMeasure(joints=("rail", "elbow"), positions=((120.0, -0.5),), platform_mm=((1.0, 2.0, 3.0),))
    assert pose_list(poses, (False, True), "a.csv") == (
        "act_rail_mm,act_elbow_rad,platform_x_mm,platform_y_mm,platform_z_mm\n120.000000,-0.500000,1.000,2.000,3.000\n"
    )
    told = json.loads(pose_list(poses, (False, True), "a.json"))
    assert told == {"joint_names": ["rail", "elbow"], "points": [{"positions": [0.12, -0.5]}]}


@pytest.mark.campaign  # test_ur10.py asks about the sample in CI
def test_the_sample_asks_for_poses_that_its_arm_reaches(tmp_path):
    done = camcomp(
        "diagnose", "samples/ur10/experiment.yaml", "--json", tmp_path / "o.json", "--next-program", tmp_path / "p.csv"
    )
    assert done.returncode == 0, done.stderr.decode()
    proposal = json.loads((tmp_path / "o.json").read_text())["next_experiment"]
    assert "40 more poses" in proposal["action"] and len(proposal["outcomes"]) == 3
    poses = table(tmp_path / "p.csv")
    joints = np.stack([poses[f"act_{a}_rad"] for a in proposal["poses"]["joints"]], axis=1)
    np.testing.assert_allclose(joints, proposal["poses"]["positions"], atol=1e-6)
    assert joints.shape == (40, 6) and (np.abs(joints) <= np.pi).all()
    place = np.stack([poses[f"platform_{x}_mm"] for x in "xyz"], axis=1)
    np.testing.assert_allclose(place, platform(joints), atol=0.01)


def test_forty_poses_by_design_tell_more_than_most_choices_by_chance():
    """Poses of campaign A of the UR10, chosen without their tips; judged by the residual on campaign B."""
    robot, runs = campaigns()
    bench = ArmBench(robot=robot, causes=(), campaigns=runs)
    columns = [c for c in bench.columns() if c.effect in ("link_geometry", "gravity_compliance")]
    a, b = bench.groups(columns, 1.0)
    rows, noise = np.concatenate([a.A, a.N], axis=2), 0.25
    prior = np.diag(np.r_[np.ones(len(columns)), [1e-4] * 3, [100.0] * 6])

    def left(chosen):
        A = rows[chosen].reshape(-1, rows.shape[2]) / noise
        found = np.linalg.solve(A.T @ A + np.linalg.inv(prior), A.T @ a.y[chosen].ravel() / noise)
        rest = without_nuisances(b.y - b.A @ found[: len(columns)], b.N)
        return float(np.sqrt((rest**2).sum(axis=1).mean()))

    rng = np.random.default_rng(0)
    by_chance = np.array([left(rng.choice(len(rows), 40, replace=False)) for _ in range(100)])
    own = left(list(designed(rows / noise, prior, 40).chosen))
    assert own < 0.95 * by_chance.mean()
    assert (by_chance < own).mean() < 0.3
