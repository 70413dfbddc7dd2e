"""The two studies of logs without a program on data whose truth is known."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from camcomp.diagnosis.arm.plausible import check_poses
from camcomp.diagnosis.arm.poses import Poses
from camcomp.diagnosis.arm.registration import register
from camcomp.diagnosis.axis.findings import AxisRun
from camcomp.diagnosis.axis.noise_floor import rows_floor
from camcomp.diagnosis.axis.plausible import check_axes
from camcomp.diagnosis.model.noise import StatedDeviation
from camcomp.ground.errors import ConfigError
from camcomp.model.config.load import load_config
from camcomp.model.statics.build import build_robot
from camcomp.model.statics.hanging import hang
from tests.studies import arm_study, axis_study
from tests.validation.plants.arm_poses import measured


def run(name, seed, low, high, **truth):
    q = np.random.default_rng(seed).uniform(low, high, (250, 6))
    time = np.arange(250.0) + np.random.default_rng(seed).uniform(0.0, 0.4, 250)  # a clock, no row numbers
    return Poses(label=name, q=q, tip=measured(q, seed, **truth), time=time, temperature=None, run=np.full(250, name))


@pytest.fixture(scope="module")
def robot():
    return build_robot(load_config(["config/ur10.yaml"]).robot, [0.0, 0.0, 0.0])[0]


A, B = ([-2, -2.5, -2, -3, -2, -3], [1, -0.3, 2, 3, 2, 3]), ([-1, -1.8, -1, -2, -1, -2], [2, 0.1, 1.5, 1, 2.5, 2])
TRUTH = {"longer": 0.7, "soft": 1.2e-8}
STATED = StatedDeviation(tip_mm=0.02)  # the noise put in
NOISE_UM = 20 * np.sqrt(3)


@pytest.fixture(scope="module")
def faulty():
    return run("A", 1, *A, **TRUTH), run("B", 2, *B, **TRUTH)


@pytest.fixture(scope="module")
def healthy():
    return run("A", 3, *A), run("B", 4, *B)


def known(result):
    return {(c.effect, c.target) for c in result.known}


FAULTS = {("link_length", "elbow"), ("gravity_compliance", "shoulder_lift")}


@pytest.mark.campaign  # test_answers_on_poses has one in the plain run
def test_a_longer_link_and_a_soft_joint_are_found_on_other_campaigns(robot, faulty):
    result = arm_study(robot, (), faulty, holdout=["B"], stated=STATED)
    assert result.verdict == "identified"
    assert known(result) == FAULTS
    longer = next(c for c in result.causes if c.effect == "link_length")
    assert longer.parameters["length_mm"].value == pytest.approx(0.7, rel=0.05)
    soft = next(c for c in result.causes if c.effect == "gravity_compliance")
    assert soft.parameters["compliance_rad_per_Nmm"].value == pytest.approx(1.2e-8, rel=0.05)
    assert result.shrinkage.after_rms_um == pytest.approx(NOISE_UM, rel=0.15)
    assert result.floor.um == result.gap.noise_floor_um == pytest.approx(NOISE_UM, rel=1e-3)
    assert result.floor.source == "stated"
    assert all(m.size_um < 0.3 * NOISE_UM for m in result.minor)


@pytest.mark.campaign  # test_answers_on_poses has one in the plain run
def test_without_a_floor_nothing_is_identified_and_nothing_is_none(robot, faulty, healthy):
    result = arm_study(robot, (), faulty, holdout=["B"])
    assert (result.verdict, result.floor.um, result.floor.source) == ("ambiguous", None, "not identifiable")
    assert result.gap.noise_floor_um is None
    assert known(result) >= FAULTS
    assert any(c.effect == "unknown" for one in result.alternatives for c in one)
    assert "once more" in result.next_experiment.action
    result = arm_study(robot, (), healthy)
    assert (result.verdict, result.floor.um, result.known) == ("ambiguous", None, ())
    assert result.causes[0].probability == 0.5


def test_an_arm_that_is_its_model_has_no_cause(robot, healthy):
    for runs in (healthy, healthy[:1]):
        result = arm_study(robot, (), runs, stated=STATED)
        assert (result.verdict, result.causes, result.alternatives) == ("none", (), ())
        assert result.gap.rms_um == pytest.approx(NOISE_UM, rel=0.1)


def test_two_mistakes_of_millimetres_among_sixty_poses_bend_no_model_of_many_columns_to_them(robot, healthy):
    few = healthy[0].take(np.arange(250) < 62)
    tip, wrong = few.tip.copy(), [44, 57]
    tip[wrong] += np.array([[3.0, -2.0, 2.5], [-4.0, 1.5, 2.0]])
    result = arm_study(robot, (), [replace(few, tip=tip)], stated=STATED)
    assert (result.verdict, result.causes) == ("none", ())
    assert [each.row - 1 for each in result.outliers] == wrong
    assert result.gap.rms_um == pytest.approx(NOISE_UM, rel=0.2)


@pytest.mark.campaign  # the sample of the UR10 has repeats, too
def test_the_floor_is_what_repeats_show(robot, faulty):
    again = [replace(r, tip=r.tip + 0.0, time=r.time + 500.0) for r in faulty]
    rng = np.random.default_rng(9)
    for r in again:  # other noise of the same size as far as these poses tell
        r.tip[:] = r.tip + 0.02 * np.sqrt(2.0) * rng.standard_normal(r.tip.shape)
    some = [r.take(np.arange(0, 250, 5)) for r in again]
    result = arm_study(robot, (), [*faulty, *some], holdout=["B"])
    assert result.floor.source == "repeats"
    assert result.floor.um == pytest.approx(NOISE_UM, rel=0.1)
    assert known(result) == FAULTS
    stood = [replace(r, time=f.time[::5] + 0.1) for r, f in zip(some, faulty, strict=True)]
    assert arm_study(robot, (), [*faulty, *stood], holdout=["B"]).floor.source == "rest"


def weary(r, amplitude, seed):
    """The shoulder lift gives way by the square of its load: no effect of the library makes it."""
    carried = np.cos(r.q[:, 1]) + 0.4 * np.cos(r.q[:, 1] + r.q[:, 2])
    error = np.outer(amplitude * carried * np.abs(carried), np.eye(6)[1])
    return replace(r, tip=measured(r.q, seed, error=error, **TRUTH))


@pytest.mark.campaign  # test_answers_on_poses has one in the plain run
@pytest.mark.parametrize("stated", [STATED, StatedDeviation()])
def test_what_the_library_lacks_is_unknown_and_named_by_what_it_depends_on(robot, faulty, stated):
    runs = [weary(r, 3e-4, k + 1) for k, r in enumerate(faulty)]
    result = arm_study(robot, (), runs, stated=stated)
    assert result.verdict == "unknown"
    assert FAULTS <= known(result)
    assert result.where.drivers[0].covariate == "force:shoulder_lift"
    assert result.causes[-1].probability > 0.9  # the calibration map states no more


@pytest.mark.campaign  # programs are in the plain run (tests/validation/recorded)
def test_order_and_doubled_rows_change_nothing(robot, faulty):
    first = arm_study(robot, (), faulty, holdout=["B"], stated=STATED)
    mixed = np.random.default_rng(0).permutation(250)
    other = [r.take(mixed) for r in reversed(faulty)]
    assert arm_study(robot, (), other, holdout=["B"], stated=STATED).to_json() == first.to_json()
    doubled = [r.take(np.r_[0:250, 0:40]) for r in faulty]
    assert arm_study(robot, (), doubled, holdout=["B"], stated=STATED).to_json() == first.to_json()
    slower = [replace(r, time=60.0 * r.time) for r in faulty]
    assert arm_study(robot, (), slower, holdout=["B"], stated=STATED).to_json() == first.to_json()


@pytest.mark.campaign  # programs are in the plain run (tests/validation/recorded)
@pytest.mark.parametrize("trials", [1, pytest.param(12, marks=pytest.mark.campaign)])
def test_less_data_gives_no_more_certainty(robot, faulty, trials):
    """Poses and campaigns left out of experiments that are unknown or ambiguous: none becomes another single cause."""
    rng = np.random.default_rng(5)
    unlisted = [weary(r, 3e-4, k + 1) for k, r in enumerate(faulty)]
    wrong = 0
    for trial in range(trials):
        runs, stated = ((unlisted, STATED), (faulty, StatedDeviation()), (faulty[:1], STATED))[trial % 3]
        some = [r.take(np.sort(rng.choice(250, int(rng.integers(30, 150)), replace=False))) for r in runs]
        some = some[: 1 + int(rng.integers(len(some)))]
        result = arm_study(robot, (), some, stated=stated)
        wrong += result.verdict in ("identified", "none")
    assert wrong == 0


@pytest.mark.parametrize(
    ("rule", "words", "spoil"),
    [
        ("CC407", "degrees", lambda q, tip: (np.degrees(q), tip)),
        ("CC407", "in m$", lambda q, tip: (q, tip / 1e3)),
        ("CC408", "elbow and wrist_1 exchanged", lambda q, tip: (q[:, [0, 1, 3, 2, 4, 5]], tip)),
        ("CC408", "elbow reversed", lambda q, tip: (q * [1, 1, -1, 1, 1, 1], tip)),
        ("CC408", "two of its axes", lambda q, tip: (q, tip[:, [1, 0, 2]])),
        ("CC412", "1 row behind", lambda q, tip: (q[1:], tip[:-1])),
        ("CC412", "1 row ahead", lambda q, tip: (q[:-1], tip[1:])),
        ("CC413", "from where the arm", lambda q, tip: (q + [0, 0, 0.3, 0, 0, 0], tip)),
    ],
)
def test_poses_that_cannot_be_the_arms_are_refused_with_what_they_look_like(robot, faulty, rule, words, spoil):
    check_poses("a.csv", "A", robot, faulty[0].q, faulty[0].tip)
    with pytest.raises(ConfigError, match=words) as refused:
        check_poses("a.csv", "A", robot, *spoil(faulty[0].q, faulty[0].tip))
    assert refused.value.rule == rule


def test_registration_finds_frame_and_tool():
    rng = np.random.default_rng(5)
    point, pose = rng.uniform(-800, 800, (50, 3)), Rotation.random(50, rng).as_matrix()
    frame = Rotation.from_euler("XYZ", [2.0, -1.0, 3.0])
    found = register(
        frame.apply(point + pose @ [10.0, -20.0, 150.0]) + [1000.0, -2000.0, 300.0], point, pose, np.zeros(3)
    )
    np.testing.assert_allclose(found.rotation, frame.as_matrix(), atol=1e-9)
    np.testing.assert_allclose(found.tool, [10.0, -20.0, 150.0], atol=1e-6)
    np.testing.assert_allclose(found.origin, [1000.0, -2000.0, 300.0], atol=1e-6)


def axis_log(lag=0.005, coulomb=30.0, viscous=0.1, lopsided=0.0, line=0.0, seed=0, step=4e-3):
    t = np.arange(0.0, 16.0, step)
    position = 100 * np.sin(0.9 * t) + 40 * np.sin(2.3 * t + 0.4)
    speed = 90 * np.cos(0.9 * t) + 92 * np.cos(2.3 * t + 0.4)
    push = -81 * np.sin(0.9 * t) - 92 * 2.3 * np.sin(2.3 * t + 0.4)
    rng = np.random.default_rng(seed)
    force = 0.08 * push + coulomb * np.tanh(speed / 0.5) + viscous * speed + lopsided * np.abs(speed)
    force += line * np.sin(2 * np.pi * position / 5.0) + 0.5 * rng.standard_normal(len(t))
    setpoint = position + lag * speed + 5e-4 * rng.standard_normal(len(t))
    return AxisRun(name="r", time=t, setpoint=setpoint, encoder=position, force=force)


def test_an_axis_with_lag_friction_and_an_unlisted_ripple():
    result = axis_study({"x": [axis_log(lopsided=-0.03, line=2.0)]})
    parameters = {c.effect: c.parameters for c in result.causes}
    assert parameters["servo_lag"]["time_constant_ms"].value == pytest.approx(5.0, rel=0.01)
    assert parameters["friction"]["force_N"].value == pytest.approx(30.0, rel=0.03)
    assert parameters["friction"]["asymmetry_Ns_per_mm"].value == pytest.approx(-0.03, rel=0.1)
    assert result.verdict == "unknown"
    line = result.where.drivers[0]
    assert line.period_mm == pytest.approx(5.0, rel=0.005)
    assert line.amplitude_N == pytest.approx(2.0, rel=0.1)


def test_what_is_not_there_is_not_found():
    result = axis_study({"x": [axis_log()]})
    assert {c.effect for c in result.causes} == {"servo_lag", "friction"}
    assert "asymmetry_Ns_per_mm" not in result.causes[-1].parameters
    assert result.where.drivers == ()
    assert result.verdict == "identified"
    still = axis_study({"x": [axis_log(lag=0.0, coulomb=0.0, viscous=0.0)]})
    assert still.causes == ()


@pytest.mark.campaign  # friction of all runs is in the plain run
def test_friction_that_one_run_of_four_lacks_is_not_named():
    """It lowers the mean rms of runs that were not fitted, and one of them speaks against it."""

    def runs(coulomb):
        logs = [axis_log(lag=0.0, coulomb=c, viscous=0.0, seed=k) for k, c in enumerate(coulomb)]
        return [
            AxisRun(name=f"r{k}", **{f: getattr(log, f)[::5] for f in ("time", "setpoint", "encoder", "force")})
            for k, log in enumerate(logs)
        ]

    assert [c.effect for c in axis_study({"x": runs((30.0, 30.0, 30.0, 30.0))}).causes] == ["friction"]
    assert axis_study({"x": runs((30.0, 30.0, 30.0, 3.0))}).known == ()


def test_rows_of_an_axis_tell_its_floor_and_an_experiment_may_state_it():
    result = axis_study({"x": [axis_log()]})
    assert (result.verdict, result.floor.source) == ("identified", "rows")
    assert result.floor.um == pytest.approx(np.hypot(0.5, 1.0), rel=0.05)  # noise, and 1 um of repeatability
    result = axis_study({"x": [axis_log()]}, stated=StatedDeviation(encoder_mm=5e-4, force_N=0.5))
    assert (result.verdict, result.floor.source, result.floor.um) == ("identified", "stated", 0.5)
    assert {c.effect for c in result.causes} == {"servo_lag", "friction"}
    assert (
        axis_study({"x": [axis_log(step=1e-3)]}, stated=StatedDeviation(encoder_mm=5e-4, force_N=0.15)).verdict
        == "unknown"
    )


def test_the_resolution_of_an_encoder_is_noise():
    log = axis_log()
    coarse = replace(
        log, encoder=np.round(log.encoder / 0.002) * 0.002, setpoint=np.round(log.setpoint / 0.002) * 0.002
    )
    result = axis_study({"x": [coarse]})
    assert result.verdict == "identified"
    assert {c.effect for c in result.causes} == {"servo_lag", "friction"}
    assert 1.0 < result.floor.um < 2.5
    mass = result.axes_in_detail["x"]["force"]["mass_kg"].value
    assert mass == pytest.approx(80.0, rel=0.006)  # accelerations of a coarse encoder would make it smaller
    slow = np.round(3e-5 * np.arange(4000.0) / 0.002) * 0.002
    assert rows_floor([slow]) == pytest.approx(0.002 / np.sqrt(12.0))


def test_a_standing_axis_that_seldom_leaves_a_coarse_count_has_the_noise_of_its_readings():
    read = 0.008 * np.round(np.random.default_rng(1).normal(0.0, 0.0025, 20000) / 0.008)
    assert np.mean(read == 0.0) > 0.8
    assert rows_floor([read]) == pytest.approx(np.std(read), rel=0.04)


@pytest.mark.campaign
def test_what_a_coarse_encoder_does_by_way_of_speed_and_acceleration_is_noise_too():
    log = axis_log(step=1e-3)
    nothing = np.full(len(log.time), np.nan)

    def forces(step):
        return axis_study({"x": [replace(log, encoder=np.round(log.encoder / step) * step, setpoint=nothing)]})

    fine, coarse = forces(1e-6), forces(0.02)
    assert fine.floor.um == pytest.approx(500.0, rel=0.02)  # mN
    assert fine.verdict == coarse.verdict == "identified"
    assert coarse.axes_in_detail["x"]["force"]["mass_kg"].value == pytest.approx(80.0, rel=0.006)
    coarse_tips = axis_study({"x": [replace(log, encoder=np.round(log.encoder / 0.02) * 0.02)]})
    assert coarse_tips.floor.um > 5.0


def test_a_push_of_an_axis_is_named_with_its_time():
    log = axis_log()
    force = log.force.copy()
    force[1000:1150] += 3.0
    result = axis_study({"x": [replace(log, force=force, started=100.0)]})
    assert result.verdict == "identified"
    (push,) = (c for c in result.causes if c.effect == "disturbance")
    low, high = push.parameters["force_N"].ci95
    assert low < -3.0 < high and high - low < 1.0
    assert push.parameters["from_s"].value == pytest.approx(100.0 + log.time[1000], abs=0.02)
    assert push.parameters["to_s"].value == pytest.approx(100.0 + log.time[1150], abs=0.02)
    assert {c.effect for c in result.causes} == {"servo_lag", "friction", "disturbance"}


def test_forces_of_a_withheld_run_are_judged_by_themselves():
    """The gap before is that of the withheld run, which pushes harder, not of the others."""
    whole, other = axis_log(), axis_log(seed=1)
    nothing = np.full(len(whole.time), np.nan)
    seen = replace(whole, name="a", setpoint=nothing)
    held = replace(other, name="b", setpoint=nothing).of((other.time > 2.5) & (other.time < 5.5))
    result = axis_study({"x": [seen, held]}, holdout=["b"])
    size = 1e3 * np.sqrt(np.mean((held.force - seen.force.mean()) ** 2))
    assert result.verdict == "identified"
    assert result.shrinkage.before_rms_um == pytest.approx(size, rel=0.05)
    assert abs(1e3 * seen.force.std() / size - 1.0) > 0.1


@pytest.mark.campaign  # a push is in the plain run
def test_a_shift_of_set_points_is_located_in_time():
    log = axis_log()
    setpoint = log.setpoint.copy()
    setpoint[1000:1150] += 0.01
    result = axis_study({"x": [replace(log, setpoint=setpoint)]})
    assert result.verdict == "unknown"
    first = result.where.intervals[0]
    assert first.t0_s < 4.0 and first.t1_s > 4.6 and first.t1_s - first.t0_s < 1.6
    assert {c.effect for c in result.known} == {"servo_lag", "friction"}


@pytest.mark.campaign  # beam breaks of an arm are in the plain run
def test_spikes_of_an_encoder_are_listed_and_not_fitted():
    log, rows = axis_log(), np.arange(25, 4000, 50)
    encoder = log.encoder.copy()
    encoder[rows] += 30.0
    result = axis_study({"x": [replace(log, encoder=encoder)]})
    assert result.verdict == "identified"
    assert [o.row for o in result.outliers] == [k + 1 for k in rows]
    lag = next(c for c in result.causes if c.effect == "servo_lag")
    assert lag.parameters["time_constant_ms"].value == pytest.approx(5.0, rel=0.01)


@pytest.mark.campaign  # test_result has it in the plain run
def test_what_is_chosen_is_judged_on_runs_that_were_not_fitted():
    runs = [replace(axis_log(seed=k), name=f"r{k}") for k in range(4)]
    result = axis_study({"x": runs})
    low, high = result.shrinkage.ci95
    assert result.shrinkage.holdout == ("r0", "r1", "r2", "r3")
    assert 0.99 < low <= result.shrinkage.ratio <= high <= 1.0
    assert axis_study({"x": runs[:1]}).shrinkage is None


@pytest.mark.parametrize(
    ("rule", "words", "spoil"),
    [
        ("CC407", "as if logged in m", lambda r: {"x": replace(r, encoder=r.encoder / 1e3)}),
        (
            "CC407",
            "positions of x look",
            lambda r: {"x": replace(r, encoder=r.encoder / 1e3, setpoint=r.setpoint / 1e3)},
        ),
        ("CC407", "logged in ms", lambda r: {"x": replace(r, time=1e3 * r.time)}),
        ("CC408", "opposite", lambda r: {"x": replace(r, encoder=-r.encoder)}),
        (
            "CC408",
            "fit the encoder of y",
            lambda r: {"x": replace(r, encoder=r.encoder[::-1] * 0.5), "y": replace(r, setpoint=r.encoder[::-1] * 0.5)},
        ),
    ],
)
def test_axes_that_cannot_be_what_their_columns_say_are_refused(rule, words, spoil):
    check_axes("a.csv", {"x": axis_log()})
    with pytest.raises(ConfigError, match=words) as refused:
        check_axes("a.csv", spoil(axis_log()))
    assert refused.value.rule == rule


def test_logs_that_say_nothing_are_refused():
    nothing = np.full(100, np.nan)
    with pytest.raises(ValueError, match="no axis"):
        axis_study({"x": [AxisRun(name="r", time=np.arange(100.0), setpoint=nothing, encoder=nothing, force=nothing)]})


def test_an_arm_whose_base_bends_is_judged_with_a_warning(robot, healthy):
    """A column that turns by 4e-8 rad per N mm of the overturning moment of 1000 N at the flange."""
    poses = healthy[0]
    point = hang(robot, poses.q).point
    moment = np.cross(point, [0.0, 0.0, -1000.0])
    bent = poses.tip + np.cross(4e-8 * moment, point)
    (warning,) = check_poses("a.csv", "A", robot, poses.q, bent)
    assert "a base that bends" in warning and "explains most of it" in warning
