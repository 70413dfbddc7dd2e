"""A loop of second order: against the solution of its differential equation, beside servo_lag, taken out of a circle."""

import numpy as np
import pytest
from scipy.signal import cont2discrete, lfilter

from camcomp.ground import shelf
from camcomp.model.effect import Motion, nominal
from tests.validation import runner
from tests.validation.plants.motion import Timeline, read
from tests.validation.plants.slides import Axes, experiment

STEP_S = 1e-3
T = np.arange(2000) * STEP_S
# up to 50 mm/s within 0.1 s and down again
SPEED = np.interp(T, [0.2, 0.3, 1.0, 1.1], [0.0, 50.0, 50.0, 0.0])
WAY = np.cumsum(SPEED) * STEP_S


def loop(way, above, below):
    """A set-point (n,) through a transfer function, straight between samples."""
    b, a, _ = cont2discrete((above, below), STEP_S, method="foh")
    return way[0] + lfilter(b.ravel(), a, way - way[0])


def encoder(*effects):
    x = WAY[:, None]
    for name, values in effects:
        zero, effect = np.zeros_like(x), shelf.load("effects", name)
        m = Motion(
            time=T,
            common=T,
            cut_min=T,
            temperature=None,
            encoder=x,
            speed=zero,
            direction=zero,
            home=np.zeros(1),
            stiffness=np.array([1e4]),
        )
        x = effect.on_servo(x, m, np.ones(1), {**nominal(effect), **values})
    return x[:, 0]


@pytest.mark.parametrize("damping", [0.15, 0.7, 2.0])
def test_it_solves_its_equation(damping):
    w = 2.0 * np.pi / 0.05
    true = loop(WAY, [2 * damping * w, w * w], [1.0, 2 * damping * w, w * w])
    got = encoder(("servo_overshoot", {"period_ms": 50.0, "damping": damping}))
    assert np.abs(true - WAY).max() > 0.01
    assert np.abs(got - true).max() < 0.01 * np.abs(true - WAY).max()
    assert np.abs(got - WAY)[800:1000].max() < 1e-3, "at constant speed it is not late"


@pytest.mark.parametrize("damping", [0.02, 0.7, 1.0, 5.0])
@pytest.mark.parametrize("period_ms", [500.0, 50.0, 1.0, 1e-3])
def test_however_short_its_period_is_against_the_rows_it_is_exact(period_ms, damping):
    w = 2e3 * np.pi / period_ms
    pushed = np.append(np.diff(np.append(WAY[0], WAY), n=2), 0.0) / STEP_S**2
    b, a, _ = cont2discrete(([-1.0], [1.0, 2 * damping * w, w * w]), STEP_S, method="foh")
    true = lfilter(b.ravel(), a, pushed)
    got = encoder(("servo_overshoot", {"period_ms": period_ms, "damping": damping})) - WAY
    assert np.abs(got - true).max() < 1e-6 * np.abs(true).max() + 1e-13


def test_with_a_lag_it_is_the_plain_loop_of_second_order_and_with_much_damping_the_lag_alone():
    w, damping = 2.0 * np.pi / 0.05, 0.4
    both = (
        ("servo_lag", {"time_constant_ms": 2e3 * damping / w}),
        ("servo_overshoot", {"period_ms": 50.0, "damping": damping}),
    )
    plain = loop(WAY, [w * w], [1.0, 2 * damping * w, w * w])
    assert np.abs(encoder(*both) - plain).max() < 0.005 * np.abs(plain - WAY).max()
    late = 50.0 * 2 * damping / w
    assert (WAY - encoder(*both))[950] == pytest.approx(late, rel=1e-3)
    tau, much = 4e-3, 4.0  # as late, ever more damped
    few = [
        np.abs(
            encoder(
                ("servo_lag", {"time_constant_ms": 1e3 * tau}),
                ("servo_overshoot", {"period_ms": 1e3 * np.pi * tau / d, "damping": d}),
            )
            - encoder(("servo_lag", {"time_constant_ms": 1e3 * tau}))
        ).max()
        for d in (1.0, much)
    ]
    assert few[1] < 0.1 * few[0]


def test_a_circle_comes_out_smaller_by_what_the_loop_swings_out(tmp_path):
    """At 50 mm/s round 10 mm a loop of 80 ms swings 40 um out; an independent filter follows the program."""
    (tmp_path / "in.nc").write_text("G21 G90 G17 G94\nG0 X10 Y0 Z0\nG3 X10 Y0 I-10 J0 F3000\nM2\n")
    more = "effects: [{effect: servo_overshoot, period_ms: 80, damping: 0.7}]\nprocess: {force: {model: none}}\n"
    (tmp_path / "more.yaml").write_text(more)
    files = ["--config", "config/cartesian.yaml", "--config", str(tmp_path / "more.yaml")]
    out = tmp_path / "out.nc"
    code, said = runner.invoke(["compensate", str(tmp_path / "in.nc"), *files, "-o", str(out)])
    assert code in (0, 1), said
    w = 2.0 * np.pi / 0.08
    left = []
    for text in ((tmp_path / "in.nc").read_text(), out.read_text()):
        line = Timeline(read(text), looks_ahead=True)
        tip = line.sample(np.arange(0.0, line.log_end, STEP_S))["tip"]
        tip = np.stack([loop(each, [1.4 * w, w * w], [1.0, 1.4 * w, w * w]) for each in tip.T], 1)
        on = slice(len(tip) // 2, 3 * len(tip) // 4)
        left.append(np.hypot(tip[on, 0], tip[on, 1]) - 10.0)
    assert left[0].mean() == pytest.approx(50.0**2 / 10.0 / w**2, rel=0.05)
    assert np.abs(left[1]).max() < 0.1 * left[0].mean()


RUNS = (
    ("G0 X15 Y0 Z0\nG3 X15 Y0 I-15 J0 F3000\n", 0.0),
    ("G0 X15 Y0 Z0\nG1 Y20 F1800\nX-10\nY0\nX15\n", 100.0),
)


@pytest.mark.campaign  # test_every_machine has one in the plain run
def test_it_is_found_by_set_points_and_encoders(tmp_path):
    """A plain loop of 50 ms that swings is late, too: both are named, and together they are the loop."""
    w, damping = 2.0 * np.pi / 0.05, 0.3

    def moved(common, asked):
        there = asked.copy()
        there[:, 1] = loop(asked[:, 1], [w * w], [1.0, 2 * damping * w, w * w])
        return Axes(there, there)

    result = runner.ask(experiment(tmp_path, RUNS, moved, every=10))
    found = {each["effect"]: each for each in result["causes"]}
    assert (result["verdict"], set(found)) == ("identified", {"servo_overshoot", "servo_lag"})
    assert {each["target"] for each in found.values()} == {"y"}
    values = {name: each["value"] for one in found.values() for name, each in one["parameters"].items()}
    assert values["period_ms"] == pytest.approx(50.0, rel=0.05)
    assert values["damping"] == pytest.approx(damping, rel=0.05)
    assert values["time_constant_ms"] == pytest.approx(2e3 * damping / w, rel=0.05)


def test_an_effect_that_guesses_its_shape_says_among_how_many():
    """The best of so many is prior evidence for none of them: one of the others would have fitted as well by chance."""
    guessing = [module for _, module in shelf.usable("effects") if hasattr(module, "guess")]
    assert len(guessing) > 1 and all(module.GUESSED_FROM > 50 for module in guessing)


def test_it_is_guessed_from_the_rows_alone():
    """Encoders every 10 ms, beside a lag: a straight line between them is off by more than the loop swings."""
    w, lag, rows = 2.0 * np.pi / 0.05, 0.004, slice(None, None, 10)
    swung = loop(WAY, [2 * 0.6 * w, w * w], [1.0, 2 * 0.6 * w, w * w])
    read = np.full_like(WAY, np.nan)
    read[rows] = loop(swung, [1.0], [lag, 1.0])[rows]
    effect = shelf.load("effects", "servo_overshoot")
    found = effect.public(effect.guess([(T, WAY, read)], hinge=False))
    assert found == pytest.approx({"period_ms": 50.0, "damping": 0.6}, rel=0.02)
    lines = np.interp(T, T[rows], read[rows])
    found = effect.public(effect.guess([(T, WAY, lines)], hinge=False))
    assert found != pytest.approx({"period_ms": 50.0, "damping": 0.6}, rel=0.02)
