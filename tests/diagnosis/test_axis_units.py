"""Logs of axes against closed forms: effects of the machine file count, joints are judged at the tip and in rad."""

import numpy as np
import pytest
import yaml
from ruamel.yaml import YAML

from camcomp.api.diagnosis import diagnose
from camcomp.diagnosis.report.answer import verdict_text
from camcomp.diagnosis.result.types import Estimate, FoundCause
from camcomp.ground.errors import ConfigError
from camcomp.model.config.load import load_config
from camcomp.model.config.write_back import with_causes
from tests.commandline import ROOT

SIX = """robot:
  name: six joints
  type: serial
  convention: modified
  joints:
    - {name: J1}
    - {name: J2, a_mm: 50, alpha_deg: -90, theta_deg: -90, start_deg: 20}
    - {name: J3, a_mm: 500, d_mm: 50, theta_deg: -90, start_deg: 100}
    - {name: J4, alpha_deg: -90, d_mm: 550, start_deg: 10}
    - {name: J5, alpha_deg: 90, start_deg: 60}
    - {name: J6, alpha_deg: -90, d_mm: 100}
tool: {length_mm: 0}
workpiece: {origin_mm: [600, 0, 200]}
"""


def write(folder, name, columns):
    rows = np.column_stack(list(columns.values()))
    np.savetxt(folder / name, rows, fmt="%.7f", delimiter=",", header=",".join(columns), comments="")


def lagging(folder, seconds=0.005):
    """A slide behind a first-order lag in its steady state, with 0.5 um of noise, and a machine file with a lag of 5 ms."""
    t = np.arange(0, 6, 0.01)
    x = 100 * np.sin(0.9 * t) + 40 * np.sin(2.3 * t + 0.4)
    late = sum(
        size / np.hypot(1, w * seconds) * np.sin(w * t + phase - np.arctan(w * seconds))
        for size, w, phase in ((100, 0.9, 0.0), (40, 2.3, 0.4))
    )
    write(
        folder, "a.csv", {"t_s": t, "cmd_x_mm": x, "act_x_mm": late + np.random.default_rng(1).normal(0, 5e-4, len(t))}
    )
    lag = {"effects": [{"effect": "servo_lag", "target": "x", "time_constant_ms": 5.0}]}
    (folder / "lag.yaml").write_text(yaml.safe_dump(lag))
    return [str(ROOT / "config/cartesian.yaml"), str(folder / "lag.yaml")]


def experiment(folder, configs, runs=("a",), **keys):
    path = folder / "experiment.yaml"
    listed = [{"name": each, "log": f"{each}.csv", "cutting": False} for each in runs]
    path.write_text(yaml.safe_dump({"config": configs, "runs": listed, **keys}))
    return path


def test_a_lag_that_the_machine_file_has_is_not_found_again(tmp_path):
    result = diagnose(experiment(tmp_path, lagging(tmp_path))).result
    assert (result.verdict, result.causes) == ("none", ())
    assert result.gap.rms_um == pytest.approx(0.5, rel=0.2)


def test_what_is_on_top_of_a_machine_file_changes_its_entry(tmp_path):
    done = diagnose(experiment(tmp_path, lagging(tmp_path, 0.008)))
    assert [c.effect for c in done.result.causes] == ["servo_lag"]
    tree = YAML(typ="safe").load(done.machine_with_causes(str(tmp_path / "new.yaml")))
    (entry,) = (each for each in tree["effects"] if each["effect"] == "servo_lag")
    assert entry["time_constant_ms"]["value"] == pytest.approx(8.0, rel=0.01)


def test_a_loop_found_on_top_of_a_stated_one_is_one_loop(tmp_path):
    """It swings with 50 ms where its file says 30: simulated step by step from rest, with noise that has heavy tails."""
    rng, step = np.random.default_rng(2), 1e-3
    t = np.arange(0.0, 20.0, step)
    x = 40.0 * np.sin(1.5 * t) ** 3 + 3.0 * np.sin(5.3 * t) ** 3
    place, speed, w, reached = 0.0, 0.0, 2.0 * np.pi / 0.05, np.empty_like(t)
    for k, (wanted, fast) in enumerate(zip(x, np.gradient(x, step), strict=True)):
        reached[k] = place
        speed += step * (w * w * (wanted - place) + w * (fast - speed))
        place += step * speed
    rows = slice(None, None, 5)
    encoder = reached[rows] + 2e-4 * rng.standard_t(3, len(t[rows]))
    write(tmp_path, "a.csv", {"t_s": t[rows], "cmd_x_mm": x[rows], "act_x_mm": encoder})
    stated = {"effects": [{"effect": "servo_overshoot", "target": "x", "period_ms": 30.0, "damping": 0.5}]}
    (tmp_path / "swings.yaml").write_text(yaml.safe_dump(stated))
    done = diagnose(experiment(tmp_path, [str(ROOT / "config/cartesian.yaml"), str(tmp_path / "swings.yaml")]))
    assert (done.result.verdict, [c.effect for c in done.result.causes]) == ("identified", ["servo_overshoot"])
    tree = YAML(typ="safe").load(done.machine_with_causes(str(tmp_path / "new.yaml")))
    (entry,) = (each for each in tree["effects"] if each["effect"] == "servo_overshoot")
    assert entry["period_ms"]["value"] == pytest.approx(50.0, rel=0.03)
    assert entry["damping"]["value"] == pytest.approx(0.5, rel=0.2)


def test_set_points_that_are_logged_late_are_told_in_a_joint_that_does_not_move_the_tip(tmp_path):
    """J6 turns about the tip; its encoder is 60 ms ahead of the log's set-points."""
    (tmp_path / "machine.yaml").write_text(SIX)
    for seed, name in enumerate("ab"):
        t, noise = np.arange(0, 10, 0.01), np.random.default_rng(seed).normal(0, 2e-5, 1000)
        asked, ahead = (0.4 * np.sin((0.8 + seed) * at) + 0.2 * np.sin(2.9 * at + 1) for at in (t, t + 0.06))
        write(tmp_path, f"{name}.csv", {"t_s": t, "cmd_J6_rad": asked, "act_J6_rad": ahead + noise})
    result = diagnose(experiment(tmp_path, ["machine.yaml"], ("a", "b"), holdout=["b"])).result
    assert result.verdict == "identified" and result.gap.rms_um == 0.0
    (cause,) = result.causes
    assert cause.parameters["time_constant_ms"].value == pytest.approx(-60.0, rel=0.02)
    left = result.shrinkage.actuators["J6"]
    assert left.after_rms < 0.01 * left.before_rms
    assert "No error moves the tip: J6 errs by" in verdict_text(result)


def steady_moves(rng, until=60.0, step=1e-3):
    """Times and positions (n,) of a slide that goes from place to place at steady speeds, reached within 40 ms, and rests for 3 s."""
    place, parts = 0.0, [np.zeros(1000)]
    while sum(map(len, parts)) * step < until:
        goal, speed = rng.uniform(0.0, 60.0), rng.choice([10.0, 20.0])
        parts += [np.linspace(place, goal, int(abs(goal - place) / speed / step) + 1)[1:], np.full(3000, goal)]
        place = goal
    way = np.convolve(np.concatenate(parts), np.ones(40) / 40, "valid")
    return step * np.arange(len(way)), way


def test_an_encoder_that_is_read_some_milliseconds_off_its_row_has_nothing_wrong(tmp_path):
    """At 10 Hz; the axis is on its set-points."""
    for seed, name in enumerate("ab"):
        rng = np.random.default_rng(seed)
        t, way = steady_moves(rng)
        row = t[100:-100:100]
        read = np.interp(row + rng.normal(0, 0.003, len(row)), t, way) + rng.normal(0, 4e-4, len(row))
        write(tmp_path, f"{name}.csv", {"t_s": row, "cmd_x_mm": np.interp(row, t, way), "act_x_mm": read})
    result = diagnose(experiment(tmp_path, [str(ROOT / "config/cartesian.yaml")], ("a", "b"), holdout=["b"])).result
    assert result.verdict == "none"


def ripple(folder, name, frequency, seed):
    """J1 with 0.6 mrad sin(50 q) over 0.02 mrad of noise; J2 stands at 20 deg and J6 at 0, and the other joints are not logged."""
    t = np.arange(0, 10, 0.01)
    q = 0.4 * np.sin(2 * np.pi * frequency * t) + 0.2 * np.sin(4.6 * np.pi * frequency * t + 1)
    act = q + 0.6e-3 * np.sin(50 * q) + np.random.default_rng(seed).normal(0, 2e-5, len(q))
    still = dict.fromkeys(("cmd_J2_rad", "act_J2_rad"), np.full(len(t), np.radians(20)))
    still |= dict.fromkeys(("cmd_J6_rad", "act_J6_rad"), np.zeros(len(t)))
    write(folder, f"{name}.csv", {"t_s": t, "cmd_J1_rad": q, "act_J1_rad": act, **still})


def test_a_ripple_of_a_joint_is_judged_in_its_own_unit_and_at_the_tip(tmp_path):
    (tmp_path / "machine.yaml").write_text(SIX)
    ripple(tmp_path, "a", 0.13, 1)
    ripple(tmp_path, "b", 0.21, 2)
    done = diagnose(experiment(tmp_path, ["machine.yaml"], ("a", "b"), holdout=["b"]))
    joint = done.result.gap.actuators["J1"]
    assert done.result.verdict == "unknown" and joint.unit == "urad"
    assert joint.rms == pytest.approx(600 / np.sqrt(2), rel=0.06) and joint.floor == pytest.approx(20, rel=0.1)
    assert done.result.gap.rms_um / joint.rms == pytest.approx(reach_mm(tmp_path) * 1e-3, rel=0.02)
    unseen = done.residuals.array("rest_act_J1_rad")[np.asarray(done.residuals["run"]) == "b"]
    claimed = done.result.shrinkage.actuators["J1"]
    assert claimed.after_rms == pytest.approx(1e6 * np.sqrt(np.nanmean(unseen**2)), rel=0.02)


def reach_mm(folder):
    """Distance of the tip from the axis of J1 in the start pose, by products of the table's transforms."""
    joints = yaml.safe_load(SIX)["robot"]["joints"]
    pose = np.eye(4)
    for joint in joints:
        alpha, angle = (
            np.radians(joint.get("alpha_deg", 0)),
            np.radians(joint.get("theta_deg", 0) + joint.get("start_deg", 0)),
        )
        a, d = joint.get("a_mm", 0), joint.get("d_mm", 0)
        about_x = np.array(
            [[1, 0, 0, a], [0, np.cos(alpha), -np.sin(alpha), 0], [0, np.sin(alpha), np.cos(alpha), 0], [0, 0, 0, 1]]
        )
        about_z = np.array(
            [[np.cos(angle), -np.sin(angle), 0, 0], [np.sin(angle), np.cos(angle), 0, 0], [0, 0, 1, d], [0, 0, 0, 1]]
        )
        pose = pose @ about_x @ about_z
    return float(np.hypot(pose[0, 3], pose[1, 3]))


TWICE = (
    [{"effect": "servo_lag", "target": "x", "time_constant_ms": 1.0}] * 2,
    [{"effect": "servo_lag", "target": "x", "time_constant_ms": 1.0}, {"effect": "servo_lag", "time_constant_ms": 2.0}],
)


@pytest.mark.parametrize("effects", TWICE, ids=["same target", "one and all"])
def test_an_effect_that_is_there_twice_is_refused(tmp_path, effects):
    (tmp_path / "twice.yaml").write_text(yaml.safe_dump({"effects": effects}))
    with pytest.raises(ConfigError, match="is there already") as caught:
        load_config([str(ROOT / "config/cartesian.yaml"), str(tmp_path / "twice.yaml")])
    assert caught.value.rule == "CC205" and caught.value.at.file.endswith("twice.yaml")


def test_several_of_a_kind_are_no_duplicates(tmp_path):
    waves = [{"effect": "screw_cyclic", "target": "x", "amplitude_mm": 0.01, "pitch_mm": each} for each in (5.0, 10.0)]
    (tmp_path / "waves.yaml").write_text(yaml.safe_dump({"effects": waves}))
    assert len(load_config([str(ROOT / "config/cartesian.yaml"), str(tmp_path / "waves.yaml")]).effects) == 2


def test_an_effect_of_all_actuators_is_parted_where_one_of_them_differs():
    text = "effects:\n  - {effect: servo_lag, time_constant_ms: 5}\n"
    found = FoundCause(
        effect="servo_lag", target="y", probability=0.99, share=0.5,
        parameters={"time_constant_ms": Estimate(value=2.0, ci95=(1.9, 2.1))},
    )  # fmt: skip
    tree = YAML(typ="safe").load(with_causes(text, [found], actuators=("x", "y")))
    assert [each["target"] for each in tree["effects"]] == ["x", "y"]
    assert tree["effects"][0]["time_constant_ms"] == 5
    assert tree["effects"][1]["time_constant_ms"]["value"] == pytest.approx(7.0)
