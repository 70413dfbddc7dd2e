"""A measured arm: the sample that travels with camcomp, and the whole data set where CAMCOMP_DATA says it is."""

import json
import os
from pathlib import Path

import numpy as np
import pytest

import camcomp
from camcomp.diagnosis.arm.poses import ArmBench, Poses
from camcomp.diagnosis.arm.study import solve
from camcomp.diagnosis.model.folds import without_nuisances
from camcomp.diagnosis.model.noise import StatedDeviation
from camcomp.model.config.load import load_config
from camcomp.model.statics.build import build_robot
from tests.commandline import ROOT, rms_um, table
from tests.commandline import camcomp as command
from tests.schemas import check as check_schema

DATA = Path(os.environ.get("CAMCOMP_DATA", "/nowhere")) / "ipa_ur10"
WHOLE = pytest.mark.skipif(not DATA.is_dir(), reason="the whole data set is not here: CAMCOMP_DATA")
GEOMETRY, GRAVITY, CURVE, BASE = "link_geometry", "gravity_compliance", "joint_curve", "base_compliance"


def diagnosed(experiment, tmp_path):
    done = command("diagnose", experiment, "--json", tmp_path / "out.json")
    assert done.returncode == 0, done.stderr.decode()
    return json.loads((tmp_path / "out.json").read_text())


def effects(result):
    return list(dict.fromkeys(c["effect"] for c in result["causes"]))


def check(result, floor, least):
    assert result["verdict"] == "unknown"
    assert result["floor"] == {"um": result["gap"]["noise_floor_um"], "source": "repeats"}
    assert 30 < result["floor"]["um"] < 45
    assert set(effects(result)) == {GEOMETRY, GRAVITY, CURVE, "unknown"}
    shrunk = result["shrinkage"]
    assert floor[0] < shrunk["after_rms_um"] < floor[1]
    assert shrunk["ci95"][0] < shrunk["ratio"] < shrunk["ci95"][1]
    assert shrunk["ratio"] > least
    assert {s["effect"] for s in shrunk["steps"]} == {GEOMETRY, GRAVITY, CURVE}
    assert shrunk["covered_rms_um"] < 0.9 * shrunk["after_rms_um"]
    for cause in (c for c in result["causes"] if c["effect"] == CURVE):
        seen = seen_at(cause["curve"])
        assert 0.25 < cause["curve"]["seen_share"] < 0.75
        assert np.median(np.array(cause["curve"]["sd_rad"])[~seen]) > 2 * np.median(
            np.array(cause["curve"]["sd_rad"])[seen]
        )
    shares = [c["share"] for c in result["causes"]]
    assert 0.9 < sum(shares) < 1.1


def seen_at(curve):
    """Which angles of a curve lie in its intervals."""
    angle = np.array(curve["angle_deg"])
    return np.any([(angle - low) % 360.0 <= high - low for low, high in curve["seen_deg"]], axis=0)


@pytest.fixture(scope="module")
def sample():
    """The sample's diagnosis; the README's test compares the output of its command."""
    return camcomp.diagnose(ROOT / "samples/ur10/experiment.yaml")


@pytest.mark.campaign  # docs/how-to/recordings.md diagnoses the sample in the plain run
def test_sample(sample):
    result = json.loads(sample.result.to_json())
    check_schema("diagnosis", result)
    assert result["floor"]["source"] == "repeats"  # 37 poses of B were visited again
    assert 20 < result["floor"]["um"] == result["gap"]["noise_floor_um"] < 40
    assert result["verdict"] == "unknown"
    assert {GEOMETRY, GRAVITY, CURVE, "unknown"} <= set(effects(result)) <= {GEOMETRY, GRAVITY, CURVE, BASE, "unknown"}
    assert result["shrinkage"]["holdout"] == ["series_B"]
    assert result["shrinkage"]["after_rms_um"] < 280
    soft = {(c["effect"], c["target"]): c["parameters"] for c in result["causes"] if c["effect"] in (GRAVITY, BASE)}
    # a base that tilts does nearly the same as a soft shoulder
    base, shoulder = soft.get((BASE, None), {}), soft.get((GRAVITY, "shoulder_lift"), {})
    low, high = (base.get("rad_per_Nmm") or shoulder["compliance_rad_per_Nmm"])["ci95"]
    assert 3e-9 < low < 1.03e-8 < high < 2e-8  # of the shoulder, by all poses of both campaigns


@pytest.mark.campaign  # docs/how-to/recordings.md diagnoses the sample in the plain run
def test_the_written_machine_file_is_one(sample, tmp_path):
    path = tmp_path / "ur10.yaml"
    path.write_text(sample.machine_with_causes(str(path)))
    assert len(load_config([path]).effects) > len(sample.result.known) - 1


@pytest.mark.campaign  # docs/how-to/recordings.md diagnoses the sample in the plain run
def test_residuals_are_those_of_its_poses(sample):
    left = sample.residuals
    fitted = ~np.isin(left["run"], sample.result.shrinkage.holdout)
    own = camcomp.ResultTable({name: values[fitted] for name, values in left.items()})

    assert rms_um(own, "gap") == pytest.approx(sample.result.gap.rms_um, rel=1e-3)
    assert rms_um(own, "rest") < 0.6 * rms_um(own, "gap")
    assert 0 < own.rows < left.rows
    out = {(each.run, each.row) for each in sample.result.outliers}
    assert out.isdisjoint(zip(left["run"], left["row"], strict=True))
    assert sample.next_program_cuts is False


@pytest.mark.campaign  # test_arms_in_mujoco and orthoglide leave effects out, too
def test_without_the_true_effects_they_are_not_made_up_from_offsets(tmp_path):
    done = command(
        "diagnose", "samples/ur10/experiment.yaml", "--json", tmp_path / "o.json", "--without", GEOMETRY,
        "--without", GRAVITY, "--without", "link_length", "--without", "screw_pitch", "--without", CURVE,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr.decode()
    result = json.loads((tmp_path / "o.json").read_text())
    assert effects(result) == ["unknown"]  # offsets alone do not hold on postures they were not fitted on


@WHOLE
@pytest.mark.campaign  # the sample is the same arm
@pytest.mark.parametrize(
    ("held", "most_um", "covered_um"),
    [("measurements_joint_configurations", 333, 260), ("measurements_grid", 235, 170)],
)
def test_whole_campaigns(tmp_path, held, most_um, covered_um):
    tables = [DATA / "Series_A/measurements_grid.csv", DATA / "Series_B/measurements_joint_configurations.csv"]
    done = command("import", *tables, "--config", "config/ur10.yaml", "-o", tmp_path / "x", "--holdout", held)
    assert done.returncode == 0, done.stderr.decode()
    log = table(tmp_path / "x" / "measurements_grid.csv")
    assert len(log["t_s"]) == 11911
    assert log["x_mm"][0] == pytest.approx(2361.9831)
    assert log["act_wrist_1_rad"][1] == pytest.approx(-0.218756)
    result = diagnosed(tmp_path / "x" / "experiment.yaml", tmp_path)
    check(result, (200, most_um), 0.6)
    assert result["shrinkage"]["covered_rms_um"] < covered_um


def campaigns():
    config = load_config([ROOT / "config/ur10.yaml"])
    robot = build_robot(config.robot, [0.0, 0.0, 0.0])[0]
    runs = []
    for name in ("series_A", "series_B"):
        log = table(ROOT / f"samples/ur10/{name}.csv")
        q = np.stack([log[f"act_{a.name}_rad"] for a in robot.actuators], axis=1)
        tip = np.stack([log[f"{axis}_mm"] for axis in "xyz"], axis=1)
        runs.append(Poses(label=name, q=q, tip=tip, time=log["t_s"], temperature=None, run=np.full(len(q), name)))
    return robot, runs


@pytest.mark.campaign  # the bench of measured data has all opponents
def test_plain_least_squares_of_everything_overfits_where_camcomp_does_not():
    robot, runs = campaigns()
    bench = ArmBench(robot=robot, causes=(), campaigns=runs)
    found = solve(robot, (), runs, ["series_B"], (), StatedDeviation())
    mine = rms(bench.gap(1, found.causes))
    columns = [c for c in bench.columns() if c.effect != CURVE and not c.shape]
    linear = bench.groups(columns, 1.0)
    plain = {}
    # every column of the shelf, and the first two harmonics of every joint as calibrations like to add
    wide = [np.concatenate([b.A, harmonics(b, columns, r.q)], axis=2) for b, r in zip(linear, runs, strict=True)]
    for name, X in (("shelf", [b.A for b in linear]), ("shelf and harmonics", wide)):
        A = np.concatenate([X[0], linear[0].N], axis=2).reshape(-1, X[0].shape[2] + 9)
        size = np.linalg.norm(A, axis=0) + 1e-12
        c = np.linalg.lstsq(A / size, linear[0].y.ravel(), rcond=1e-10)[0] / size
        left = without_nuisances(linear[1].y - X[1] @ c[: X[1].shape[2]], linear[1].N)
        inside = linear[0].y.ravel() - A @ c
        plain[name] = (float(np.sqrt((inside**2).sum() / len(runs[0].q))), rms(left))
    for inside, outside in plain.values():
        assert outside > 1.1 * inside
        assert outside > 1.05 * mine  # and worse where it was not


def harmonics(block, columns, q):
    joints = [j for j, c in enumerate(columns) if c.effect == "joint_offset"]
    names = ["shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3"]
    angle = [q[:, names.index(columns[j].target)] for j in joints]
    waves = [
        block.A[:, :, j] * f(k * a)[:, None]
        for j, a in zip(joints, angle, strict=True)
        for k in (1, 2)
        for f in (np.sin, np.cos)
    ]
    return np.stack(waves, axis=2)


def rms(gap):
    return float(np.sqrt((gap**2).sum(axis=1).mean()))
