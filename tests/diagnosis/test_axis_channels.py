"""Torques, second encoders and speed limits in logs of axes, against plants in closed form and a measured servo."""

import numpy as np
import pytest
import yaml
from scipy.signal import lfilter

from camcomp.api.diagnosis import diagnose
from camcomp.ground import shelf
from tests.commandline import ROOT
from tests.validation.measured import tables

ARM = """robot:
  name: one link
  type: serial
  convention: modified
  joints:
    - {name: J1, alpha_deg: -90, stiffness_Nmm_per_rad: 1.0e+9}
  flange: {translation_mm: [500, 0, 0]}
tool: {length_mm: 0}
workpiece: {origin_mm: [600, 0, 200]}
"""
FORCE, VISCOUS, INERTIA, WEIGHT = 2500.0, 3000.0, 900.0, 8000.0  # N mm, N mm s/rad, N mm s2/rad, N mm


def write(folder, name, columns):
    rows = np.column_stack(list(columns.values()))
    np.savetxt(folder / f"{name}.csv", rows, fmt="%.9g", delimiter=",", header=",".join(columns), comments="")


def asked(folder, configs, runs, **keys):
    listed = [{"name": each, "log": f"{each}.csv", "cutting": False} for each in runs]
    path = folder / "experiment.yaml"
    path.write_text(yaml.safe_dump({"config": configs, "runs": listed, **keys}))
    return diagnose(path).result


def test_weight_without_masses_is_said(tmp_path):
    (tmp_path / "arm.yaml").write_text(ARM)
    torque_log(tmp_path, "a", 1, rubs=False)
    asked(tmp_path, ["arm.yaml"], "a")
    assert any("no mass_kg" in note for note in diagnose(tmp_path / "experiment.yaml").notes)


def course(seed):
    """Times (n,), angle, speed and acceleration of a joint: three sines."""
    rng, t = np.random.default_rng(seed), np.arange(0.0, 12.0, 0.005)
    parts = [(0.5, 0.9, rng.uniform(0, 6)), (0.25, 2.1, rng.uniform(0, 6)), (0.1, 4.3, rng.uniform(0, 6))]
    q = sum(a * np.sin(w * t + p) for a, w, p in parts)
    speed = sum(a * w * np.cos(w * t + p) for a, w, p in parts)
    return t, q, speed, sum(-a * w * w * np.sin(w * t + p) for a, w, p in parts)


def torque_log(folder, name, seed, *, rubs):
    t, q, speed, acceleration = course(seed)
    torque = INERTIA * acceleration + WEIGHT * np.cos(q) + rubs * (FORCE * np.sign(speed) + VISCOUS * speed)
    noise = np.random.default_rng(seed + 1)
    encoder = q + noise.normal(0, 1e-6, len(t))
    write(folder, name, {"t_s": t, "act_J1_rad": encoder, "act_J1_Nmm": torque + noise.normal(0, 40.0, len(t))})


def test_torques_alone_tell_friction_inertia_and_weight_of_a_joint(tmp_path):
    (tmp_path / "arm.yaml").write_text(ARM)
    for name, seed in (("a", 1), ("b", 5)):
        torque_log(tmp_path, name, seed, rubs=True)
    result = asked(tmp_path, ["arm.yaml"], "ab", holdout=["b"])
    (friction,) = [c for c in result.causes if c.effect == "friction"]
    for name, true in (("force_Nmm", FORCE), ("viscous_Nmms_per_rad", VISCOUS)):
        low, high = friction.parameters[name].ci95
        assert low <= true <= high and high - low < 0.3 * true
    detail = result.axes_in_detail["J1"]["force"]
    assert detail["inertia_Nmms2_per_rad"].value == pytest.approx(INERTIA, rel=0.05)
    assert detail["weight_Nmm"] == pytest.approx(WEIGHT * np.std(np.cos(course(1)[1])), rel=0.05)
    assert result.shrinkage.after_rms_um < 0.1 * result.shrinkage.before_rms_um


def test_a_joint_that_does_not_rub_has_no_friction(tmp_path):
    (tmp_path / "arm.yaml").write_text(ARM)
    torque_log(tmp_path, "a", 1, rubs=False)
    assert "friction" not in [c.effect for c in asked(tmp_path, ["arm.yaml"], "a").causes]


def test_what_pushes_a_joint_for_a_while_is_located_in_time(tmp_path):
    (tmp_path / "arm.yaml").write_text(ARM)
    t, q, speed, acceleration = course(1)
    noise = np.random.default_rng(7).normal(0, 1.0, (2, len(t)))
    torque = INERTIA * acceleration + WEIGHT * np.cos(q) + FORCE * np.tanh(speed / 0.005) - 1500.0 * ((t > 4) & (t < 5))
    write(tmp_path, "a", {"t_s": t, "act_J1_rad": q + 1e-6 * noise[0], "act_J1_Nmm": torque + 40.0 * noise[1]})
    (push,) = [c for c in asked(tmp_path, ["arm.yaml"], "a").causes if c.effect == "disturbance"]
    for name, true in (("force_Nmm", 1500.0), ("from_s", 4.0), ("to_s", 5.0)):
        low, high = push.parameters[name].ci95
        assert low <= true <= high and push.parameters[name].value == pytest.approx(true, rel=0.03)


def second_encoder(folder, width, delay_s):
    """An encoder behind a play of a width, sampled a little later than that of the motor."""
    t, q, speed, _ = course(3)
    behind = np.empty_like(q)
    state = q[0]
    for i, each in enumerate(q):
        state = min(max(state, each - width / 2), each + width / 2)
        behind[i] = state
    noise = np.random.default_rng(4).normal(0, 1.5e-6, (2, len(t)))
    load = behind - delay_s * speed + 4e-4 + noise[0]
    write(folder, "a", {"t_s": t, "cmd_J1_rad": q, "act_J1_rad": q + noise[1], "load_J1_rad": load})


def test_a_second_encoder_behind_the_gear_shows_its_play(tmp_path):
    (tmp_path / "arm.yaml").write_text(ARM)
    second_encoder(tmp_path, 1.5e-4, 0.002)
    result = asked(tmp_path, ["arm.yaml"], "a")
    (play,) = [c for c in result.causes if c.effect != "unknown"]
    assert (play.effect, play.target) == ("backlash", "J1") and play.probability > 0.9
    assert play.parameters["width_rad"].value == pytest.approx(1.5e-4, rel=0.03)
    assert result.verdict == "identified" and result.gap.actuators["J1"].rms == pytest.approx(75.0, rel=0.1)
    assert result.axes_in_detail["J1"]["second_encoder"]["delay_ms"].value == pytest.approx(2.0, abs=0.1)


def soft_gear_log(folder, name, seed):
    """A gear of 10 N m/mrad between a motor that rubs and a link; the motor's torque also accelerates its rotor."""
    t, q, speed, acceleration = course(seed)
    through = INERTIA * acceleration + WEIGHT * np.cos(q)
    noise = np.random.default_rng(seed + 1).normal(0, 1.0, (3, len(t)))
    torque = through + INERTIA * acceleration + FORCE * np.tanh(speed / 0.005) + 20.0 * noise[2]
    load = q - 1e-7 * through + 1.5e-6 * noise[0]
    write(folder, name, {"t_s": t, "act_J1_rad": q + 1.5e-6 * noise[1], "load_J1_rad": load, "act_J1_Nmm": torque})


def test_a_soft_gear_bends_under_the_inertia_of_masses_that_nobody_states(tmp_path):
    (tmp_path / "arm.yaml").write_text(ARM.replace(", stiffness_Nmm_per_rad: 1.0e+9", ""))
    for name, seed in (("a", 1), ("b", 5)):
        soft_gear_log(tmp_path, name, seed)
    result = asked(tmp_path, ["arm.yaml"], "ab", holdout=["b"])
    assert result.verdict == "identified" and [c.effect for c in result.causes] == ["friction"]


def test_play_that_the_machine_file_has_is_not_found_again(tmp_path):
    (tmp_path / "arm.yaml").write_text(ARM)
    play = {"effects": [{"effect": "backlash", "target": "J1", "width_rad": 1.5e-4}]}
    (tmp_path / "play.yaml").write_text(yaml.safe_dump(play))
    second_encoder(tmp_path, 1.5e-4, 0.002)
    result = asked(tmp_path, ["arm.yaml", "play.yaml"], "a")
    assert (result.verdict, [c.effect for c in result.causes]) == ("none", [])


def test_two_encoders_that_agree_show_no_play(tmp_path):
    (tmp_path / "arm.yaml").write_text(ARM)
    second_encoder(tmp_path, 0.0, 0.002)
    result = asked(tmp_path, ["arm.yaml"], "a")
    assert (result.verdict, [c.effect for c in result.causes]) == ("none", [])


def test_a_slide_that_goes_no_faster_has_a_speed_limit(tmp_path):
    t = np.arange(0.0, 10.0, 0.01)
    wanted = np.interp(t, [0, 1, 1.2, 3, 3.5, 6, 6.3, 8, 10], [0, 0, 40, 40, -10, -10, 60, 60, 0])
    driven = np.empty_like(t)
    driven[0] = 0.0
    for i in range(1, len(t)):
        driven[i] = driven[i - 1] + np.clip(wanted[i] - driven[i - 1], -0.9, 0.9)
    noise = np.random.default_rng(2).normal(0, 0.002, len(t))
    write(tmp_path, "a", {"t_s": t, "cmd_x_mm": wanted, "act_x_mm": driven + noise})
    result = asked(tmp_path, [str(ROOT / "config/cartesian.yaml")], "a")
    found = {c.effect: c for c in result.causes}
    assert "servo_lag" not in found and "servo_overshoot" not in found
    assert found["speed_limit"].parameters["speed_mm_per_s"].value == pytest.approx(90.0, rel=0.02)


def test_a_measured_servo_has_a_speed_limit_and_no_lag(tmp_path):
    folder = tables.HERE / "uart_servo"
    for name in ("first", "second"):
        write(tmp_path, name, tables.read(folder / f"{name}.csv"))
    result = asked(tmp_path, [str(folder / "servo.yaml")], ("first", "second"), holdout=["second"])
    effects = [c.effect for c in result.causes]
    assert "speed_limit" in effects and "servo_lag" not in effects
    assert result.shrinkage.ratio > 0.8


TWO_LINKS = """robot:
  name: two links
  type: serial
  convention: modified
  joints:
    - {name: J1, alpha_deg: -90, stiffness_Nmm_per_rad: 1.0e+9}
    - {name: J2, a_mm: 500, stiffness_Nmm_per_rad: 1.0e+9}
  flange: {translation_mm: [400, 0, 0]}
tool: {length_mm: 0}
workpiece: {origin_mm: [900, 0, 0]}
"""
LINKS = 0.5, 0.25, 8.0, 0.2, 5.0, 0.3, 0.1  # m, m, kg, m, kg, kg m2, kg m2: first length, centres, masses, inertias
RUBS = np.array([[9.0, 6.0], [4.0, 2.5]])  # N m, N m s/rad of both joints


def creeping(t, speed, every_s):
    """Angle, speed and acceleration (n,) of a joint that comes to rest and creeps on every so many seconds."""
    slow = speed * np.sin(np.pi * t / every_s) ** 4
    return np.cumsum(slow) * (t[1] - t[0]), slow, np.gradient(slow, t)


def two_link_log(
    folder, name, seed, moves=1.0, *, turned=lambda speed: np.tanh(speed / 0.005), noise=0.3, creeps=False
):
    """Encoders, and torques by Siciliano et al., Robotics, 7.3.2. turned: part of the friction that a speed (n,) has turned round.

    moves: stretches the course of both joints; at 0 they stand still. noise: of torques, N m. creeps: whether they start slowly.
    """
    a1, l1, m1, l2, m2, i1, i2 = LINKS
    g, rng = 9.80665, np.random.default_rng(seed)
    (t, *first), (_, *second) = course(seed), course(seed + 20)
    if creeps:
        first, second = creeping(t, first[1], 5.2), creeping(t, second[1], 7.0)
    q1, v1, w1 = moves * np.array(first)
    q2, v2, w2 = 2.0 * moves * np.array(second)
    c2, s2 = np.cos(q2), np.sin(q2)
    both = m2 * (l2**2 + a1 * l2 * c2) + i2
    torques = [
        (i1 + m1 * l1**2 + i2 + m2 * (a1**2 + l2**2 + 2 * a1 * l2 * c2)) * w1
        + both * w2 - m2 * a1 * l2 * s2 * (2 * v1 * v2 + v2**2)
        - (m1 * l1 + m2 * a1) * g * np.cos(q1) - m2 * l2 * g * np.cos(q1 + q2),
        both * w1 + (i2 + m2 * l2**2) * w2 + m2 * a1 * l2 * s2 * v1**2 - m2 * l2 * g * np.cos(q1 + q2),
    ]  # fmt: skip
    columns = {"t_s": t}
    for name_, q in (("J1", q1), ("J2", q2)):
        columns[f"act_{name_}_rad"] = q + rng.normal(0, 1e-5, len(t))
    for k, (speed, torque) in enumerate(zip((v1, v2), torques, strict=True)):
        rubs = RUBS[k, 0] * turned(speed) + RUBS[k, 1] * speed
        columns[f"act_J{k + 1}_Nmm"] = 1e3 * (torque + rubs + rng.normal(0, noise, len(t)))
    write(folder, name, columns)


def test_joints_that_move_together_do_not_bend_each_others_friction(tmp_path):
    (tmp_path / "arm.yaml").write_text(TWO_LINKS)
    for name, seed in (("a", 1), ("b", 5)):
        two_link_log(tmp_path, name, seed)
    result = asked(tmp_path, ["arm.yaml"], "ab", holdout=["b"])
    assert result.verdict == "identified"
    for k, joint in enumerate(("J1", "J2")):
        (friction,) = [c for c in result.causes if c.target == joint]
        for name, true in zip(("force_Nmm", "viscous_Nmms_per_rad"), 1e3 * RUBS[k], strict=True):
            low, high = friction.parameters[name].ci95
            assert low <= true <= high and high - low < 0.2 * true


@pytest.mark.parametrize(
    "turned",
    [lambda v: np.clip(v / 0.004, -1.0, 1.0), lambda v: np.tanh(v / 0.02), np.sign],
    ids=["as a polygon", "smoothly", "at once"],
)
def test_friction_that_turns_round_with_the_speed_is_no_stribeck_friction(tmp_path, turned):
    (tmp_path / "arm.yaml").write_text(TWO_LINKS)
    for name, seed in (("a", 1), ("b", 5)):
        two_link_log(tmp_path, name, seed, turned=turned)
    result = asked(tmp_path, ["arm.yaml"], "ab", holdout=["b"])
    for k, joint in enumerate(("J1", "J2")):
        (friction,) = [c for c in result.causes if c.target == joint]
        assert not any(name.startswith("stribeck") for name in friction.parameters)
        low, high = friction.parameters["force_Nmm"].ci95
        assert low <= 1e3 * RUBS[k, 0] <= high


def test_friction_of_a_joint_that_creeps_is_no_disturbance(tmp_path):
    """In the run that is judged only, too, nobody knows the form of friction while it turns round."""
    (tmp_path / "arm.yaml").write_text(TWO_LINKS)
    for name, seed in (("a", 3), ("b", 7)):
        two_link_log(tmp_path, name, seed, turned=lambda v: np.clip(v / 0.004, -1.0, 1.0), noise=0.05, creeps=True)
    result = asked(tmp_path, ["arm.yaml"], "ab", holdout=["b"])
    assert {c.target for c in result.causes if c.effect == "friction"} == {"J1", "J2"}
    assert "disturbance" not in {c.effect for c in result.causes}


def test_stribeck_friction_that_turns_round_with_the_speed_is_found(tmp_path):
    (tmp_path / "arm.yaml").write_text(TWO_LINKS)
    for name, seed in (("a", 1), ("b", 5)):
        two_link_log(
            tmp_path, name, seed, turned=lambda v: (1.0 + 0.3 * np.exp(-((v / 0.06) ** 2))) * np.tanh(v / 0.01)
        )
    result = asked(tmp_path, ["arm.yaml"], "ab", holdout=["b"])
    for k, joint in enumerate(("J1", "J2")):
        (friction,) = [c for c in result.causes if c.target == joint]
        for name, true in (("stribeck_Nmm", 300.0 * RUBS[k, 0]), ("stribeck_rad_per_s", 0.06)):
            low, high = friction.parameters[name].ci95
            assert low <= true <= high and high - low < 0.4 * true


def test_an_arm_with_stated_masses_may_stand_still_in_a_run(tmp_path):
    stated = TWO_LINKS.replace("J1, ", "J1, mass_kg: 8, centre_mm: [250, 0, 0], ").replace("J2, ", "J2, mass_kg: 5, centre_mm: [200, 0, 0], ")  # fmt: skip
    (tmp_path / "arm.yaml").write_text(stated)
    for name, seed, moves in (("a", 1, 1.0), ("b", 5, 1.0), ("c", 9, 0.0)):
        two_link_log(tmp_path, name, seed, moves)
    result = asked(tmp_path, ["arm.yaml"], "abc", holdout=["b"])
    assert {c.target for c in result.causes if c.effect == "friction"} == {"J1", "J2"}


RIG = """robot:
  name: rig
  type: serial
  convention: dh
  joints:
    - {name: J, a_mm: 350}
tool: {length_mm: 0}
workpiece: {origin_mm: [350, 0, 0]}
"""


def test_a_joint_hung_otherwise_than_its_file_says_shows_its_stribeck_friction(tmp_path):
    (tmp_path / "rig.yaml").write_text(RIG)  # an upright axis; the rig's lies, and carries 20 N m
    for name, seed in (("a", 1), ("b", 5)):
        t, q, v, w = course(seed)
        rng, slow = np.random.default_rng(seed), 0.3 + 0.7 * np.sin(0.37 * t) ** 2  # it goes slowly, too
        q, v, w = q * slow, np.gradient(q * slow, t), np.gradient(np.gradient(q * slow, t), t)
        rubs = (12.0 + 6.0 * np.exp(-((v / 0.08) ** 2))) * np.tanh(v / 0.002) + 9.0 * v
        torque = 2.2 * w + 20.0 * np.sin(q + 0.4) + rubs + rng.normal(0, 0.2, len(t))
        write(tmp_path, name, {"t_s": t, "act_J_rad": q + rng.normal(0, 2e-6, len(t)), "act_J_Nmm": 1e3 * torque})
    result = asked(tmp_path, ["rig.yaml"], "ab", holdout=["b"])
    (friction,) = [c for c in result.causes if c.effect == "friction"]
    for name, true in (
        ("force_Nmm", 12e3),
        ("viscous_Nmms_per_rad", 9e3),
        ("stribeck_Nmm", 6e3),
        ("stribeck_rad_per_s", 0.08),
    ):
        low, high = friction.parameters[name].ci95
        assert low <= true <= high and high - low < 0.3 * true


def smooth_log(folder, name, seed, loop):
    """A slide that moves by three sines, in each of which its loop has settled; loop: answer of the encoder to a frequency."""
    rng, t = np.random.default_rng(seed), np.arange(0.0, 20.0, 0.005)
    wanted, reached = np.zeros((2, len(t)), complex)
    for size, frequency in ((40.0, 1.5), (10.0, 3.1), (3.0, 5.3)):
        turning = size * np.exp(1j * (frequency * t + rng.uniform(0.0, 6.0)))
        wanted, reached = wanted + turning, reached + loop(1j * frequency) * turning
    encoder = reached.imag + rng.normal(0.0, 2e-4, len(t))
    write(folder, name, {"t_s": t, "cmd_x_mm": wanted.imag, "act_x_mm": encoder})


def test_a_loop_that_would_swing_shows_by_the_acceleration_alone(tmp_path):
    """In moves that never make it ring."""
    w = 2.0 * np.pi / 0.05
    for name, seed in (("a", 1), ("b", 5)):
        smooth_log(tmp_path, name, seed, lambda s: (w * s + w * w) / (s * s + w * s + w * w))
    result = asked(tmp_path, [str(ROOT / "config/cartesian.yaml")], "ab", holdout=["b"])
    (swings,) = result.causes
    assert (result.verdict, swings.effect, swings.target) == ("identified", "servo_overshoot", "x")
    low, high = swings.parameters["period_ms"].ci95
    assert low <= 50.0 <= high and high - low < 5.0


def test_an_encoder_ahead_by_the_acceleration_is_unknown(tmp_path):
    """Too much force is fed forward, which no effect of the library does: the gap is several times the noise floor."""
    smooth_log(tmp_path, "a", 1, lambda s: 1.0 + 6e-5 * s * s)
    result = asked(tmp_path, [str(ROOT / "config/cartesian.yaml")], "a")
    assert result.verdict == "unknown" and [c.effect for c in result.causes] == ["unknown"]
    assert result.where.drivers[0].covariate == "acceleration:x"


def test_a_loop_that_stays_behind_when_it_turns_round_is_unknown(tmp_path):
    """Its friction shows in no drive force, for none is in the log; with one it is friction."""
    smooth_log(tmp_path, "a", 1, lambda s: 1.0)
    columns = np.genfromtxt(tmp_path / "a.csv", delimiter=",", names=True)
    way = np.sign(np.gradient(columns["cmd_x_mm"]))
    columns["act_x_mm"] -= 0.004 * way
    logged = {name: columns[name] for name in columns.dtype.names}
    write(tmp_path, "a", logged)
    result = asked(tmp_path, [str(ROOT / "config/cartesian.yaml")], "a")
    assert result.verdict == "unknown" and result.where.drivers[0].covariate == "reversal:x"
    force = 40.0 * way + np.random.default_rng(3).normal(0.0, 0.5, len(way))
    write(
        tmp_path, "a", logged | {"act_x_N": force + 0.05 * np.gradient(np.gradient(columns["cmd_x_mm"], 0.005), 0.005)}
    )
    result = asked(tmp_path, [str(ROOT / "config/cartesian.yaml")], "a")
    assert result.verdict == "identified" and [c.effect for c in result.causes] == ["friction"]


def milling_log(folder, name, seed):
    """Moves of a slide with stops between them, every 10 ms; its friction goes with the speed, and so is gone at rest."""
    rng, step, rows = np.random.default_rng(seed), 1e-3, 40_000
    parts, place = [], 0.0
    while sum(map(len, parts)) < rows:
        way, fast = rng.uniform(-80.0, 80.0) - place, rng.choice([10.0, 30.0, 60.0])
        rise = min(fast / 800.0, np.sqrt(abs(way) / 800.0))
        speed = np.interp(np.arange(0.0, abs(way) / (800.0 * rise) + rise, step), *zip(
            (0.0, 0.0), (rise, 1.0), (abs(way) / (800.0 * rise), 1.0), (abs(way) / (800.0 * rise) + rise, 0.0), strict=True
        ))  # fmt: skip
        parts += [place + way * np.cumsum(speed) / speed.sum(), np.full(int(rng.uniform(100, 800)), place + way)]
        place += way
    asked_for = np.concatenate(parts)[:rows]
    encoder = lfilter([1.0 / 20.0], [1.0, 1.0 / 20.0 - 1.0], asked_for)  # 19 ms
    speed = np.gradient(encoder, step)
    force = 0.06 * np.gradient(speed, step) + 150.0 * np.tanh(speed / 0.5) + 1.2 * speed
    columns = {
        "t_s": step * np.arange(rows), "cmd_x_mm": asked_for, "act_x_mm": encoder + rng.normal(0.0, 1e-3, rows),
        "act_x_N": force + rng.normal(0.0, 8.0, rows),
    }  # fmt: skip
    write(folder, name, {key: each[::10] for key, each in columns.items()})


def test_friction_that_is_gone_at_rest_is_no_stribeck_friction(tmp_path):
    for name, seed in (("a", 1), ("b", 5)):
        milling_log(tmp_path, name, seed)
    result = asked(tmp_path, [str(ROOT / "config" / "cartesian.yaml")], "ab", holdout=["b"])
    (friction,) = [c for c in result.causes if c.effect == "friction"]
    sizes = {name: each.value for name, each in friction.parameters.items()}
    assert sizes["force_N"] == pytest.approx(150.0, rel=0.03) and sizes.get("stribeck_N", 0.0) < 15.0
    assert sizes["viscous_Ns_per_mm"] == pytest.approx(1.2, rel=0.1)


def test_friction_shows_in_ten_rows_a_second(tmp_path):
    """Of a slide that stops ever so often: by which way it moves, and how fast, rows near a stop do not tell.

    Encoders are read up to 2 ms before or after their set-points.
    """
    step, coulomb, viscous, lag = 1e-3, 150.0, 1.2, 0.0115
    for name in "ab":
        rng = np.random.default_rng(ord(name))
        asked_speed, at = np.zeros(110_000), 0
        while at < 107_000:
            feed, length = rng.uniform(2.0, 50.0) * rng.choice([-1.0, 1.0]), int(rng.uniform(500, 2500))
            asked_speed[at : at + length] = feed
            at += int(rng.uniform(600, 3000))
        asked_speed = np.convolve(asked_speed, np.hanning(200) / np.hanning(200).sum(), mode="same")
        decay = np.exp(-step / lag)
        speed = lfilter([1.0 - decay], [1.0, -decay], asked_speed)
        force = coulomb * np.tanh(speed / 0.3) + viscous * speed + 0.05 * np.gradient(speed, step)
        wanted, way = np.cumsum(asked_speed) * step, np.cumsum(speed) * step
        rows = np.arange(50, len(way), 100)
        read = rows + np.round(rng.uniform(-2.0, 2.0, len(rows))).astype(int)
        write(tmp_path, name, {
            "t_s": step * rows, "cmd_x_mm": wanted[rows], "act_x_mm": way[read] + rng.normal(0.0, 2e-4, len(rows)),
            "act_x_N": force[read] + rng.normal(0.0, 3.0, len(rows)),
        })  # fmt: skip
    result = asked(tmp_path, [str(ROOT / "config/cartesian.yaml")], "ab")
    assert result.verdict == "identified" and {c.effect for c in result.causes} == {"friction", "servo_lag"}
    (friction,) = [c for c in result.causes if c.effect == "friction"]
    assert "stribeck_N" not in friction.parameters
    presliding = next(p for p in shelf.load("effects", "friction").PARAMETERS if p.name == "presliding_mm")
    # rows are too far apart for it
    assert friction.parameters["presliding_mm"].ci95 == (presliding.low, presliding.high)
    for name, true in (("force_N", coulomb), ("viscous_Ns_per_mm", viscous)):
        low, high = friction.parameters[name].ci95
        assert low <= true <= high and high - low < 0.2 * true, name
