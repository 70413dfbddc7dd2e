"""Claims of a diagnosis on unseen runs agree with its residuals and with its machine file."""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.signal import lfilter

from camcomp.api.diagnosis import diagnose
from tests.contradictions import contradictions
from tests.diagnosis.test_measured_force import JOINTS, written
from tests.report.diagnoses import result
from tests.validation.poses.plant import poses

FEW = (
    "backlash",
    "friction",
    "disturbance",
    "formula",
    "map",
    "screw_cyclic",
    "joint_curve",
    "link_geometry",
    "inertia",
)
SLIDES = ["t_s", *(f"cmd_{a}_mm" for a in "xyz")]
TIP = ["x_mm", "y_mm", "z_mm"]
ALIKE = 0.02  # share by which claims may differ


def moved(seed):
    t = np.arange(0.0, 12.0, 0.05)
    phase = 0.3 * seed
    return t, np.stack([30 * np.sin(0.5 * t + phase), 30 * np.cos(0.7 * t), 5 * np.sin(0.9 * t + phase)], axis=1)


def wrong_pitch(seed):
    t, to = moved(seed)
    return np.hstack(
        [t[:, None], to, to * [1.0008, 1.0, 1.0] + 1e-3 * np.random.default_rng(seed).standard_normal(to.shape)]
    )


def late(seed):
    t, to = moved(seed)
    fine = np.arange(0.0, t[-1] + 1e-9, 1e-4)
    behind = lfilter([1e-4 / 0.02], [1.0, 1e-4 / 0.02 - 1.0], CubicSpline(t, to)(fine) - to[0], axis=0)[::500] + to[0]
    return np.hstack([t[:, None], to, behind + 5e-4 * np.random.default_rng(seed).standard_normal(to.shape)])


def off_at_a_joint(seed):
    rng = np.random.default_rng(seed)
    q = poses(JOINTS, "joints", 60, rng)
    stands = JOINTS.stand(q + [0.0, 0.0, 0.002, 0.0, 0.0, 0.0])
    tip = stands.point + stands.turn @ [0.0, 0.0, -JOINTS.tool_mm] - JOINTS.origin + 0.02 * rng.standard_normal((60, 3))
    return np.hstack([60.0 * np.arange(60)[:, None], q, tip])


STUDIES = {
    "slides": ("cartesian.yaml", wrong_pitch, [*SLIDES, *TIP], None),
    "axes": ("cartesian.yaml", late, [*SLIDES, *(f"act_{a}_mm" for a in "xyz")], None),
    "poses": (
        "kuka-kr210.yaml",
        off_at_a_joint,
        ["t_s", *(f"act_{a}_rad" for a in JOINTS.names), *TIP],
        {"tip_mm": 0.02},
    ),
}


@pytest.mark.parametrize(
    "study", [pytest.param(k, marks=pytest.mark.campaign) if k == "slides" else k for k in STUDIES]
)
def test_claims_on_unseen_runs_are_those_of_residuals_and_of_the_written_file(tmp_path, study):
    config, rows_of, columns, sd = STUDIES[study]
    runs = [(f"r{k}", rows_of(k)) for k in range(3)]
    path = written(tmp_path, config, runs, columns, sd, effects=[], holdout=["r2"])
    done = diagnose(path, without=FEW)
    claim = done.result.as_json()["shrinkage"]
    assert contradictions(done.result.as_json()) == [] and claim["ratio"] > 0.8
    file = tmp_path / "found.yaml"
    file.write_text(done.machine_with_causes(str(file)))
    again = diagnose(written(tmp_path, str(file), runs, columns, sd, effects=[], holdout=["r2"]), without=FEW).result
    assert again.as_json()["shrinkage"]["before_rms_um"] == pytest.approx(claim["after_rms_um"], rel=ALIKE)
    if study != "axes":  # whose residuals are those of actuators
        rows = done._residuals()
        mine = rows["run"] == "r2"
        left = np.stack([rows[f"rest_{each}"][mine] for each in TIP], axis=1)
        assert 1e3 * np.sqrt((left**2).sum(axis=1).mean()) == pytest.approx(claim["after_rms_um"], rel=ALIKE)


@pytest.mark.parametrize("verdict", ["none", "identified", "ambiguous", "unknown"])
def test_a_result_without_contradictions_passes(verdict):
    assert contradictions(result(verdict).as_json()) == []


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        (
            {"gap": {"rms_um": 0.5, "p95_um": 0.8, "max_um": 1.0, "noise_floor_um": 0.87, "actuators": {}}},
            "below the floor",
        ),
        ({"verdict": "none"}, "none with"),
        ({"alternatives": [[]]}, "alternatives"),
    ],
)
def test_contradictions_are_found(changed, said):
    assert any(said in each for each in contradictions(result("identified").as_json() | changed))
