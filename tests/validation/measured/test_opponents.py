"""The opponents do what textbooks say: they find what was put in, and leave on measured data what others found."""

import numpy as np
import pytest

from tests.validation.measured import bench, tables
from tests.validation.measured import opponents_of_arms as arms
from tests.validation.measured import opponents_of_axes as axes


def left(split, quantity, opponent):
    (found,) = [q for s in bench.splits((split[0],)) if s.name == split[1] for q in s.quantities if q.name == quantity]
    return found.scale * bench.rms(found.nominal() if opponent is None else found.opponents[opponent]())


@pytest.mark.parametrize(
    ("frames", "opponent", "um"),
    [("kept", None, 561.3), ("fitted again", None, 516.0), ("kept", "geometry", 104), ("fitted again", "geometry", 95)],
)
def test_ridge_regression_of_geometry_on_a_measured_ur5(frames, opponent, um):
    assert left(("ur5", f"grid to random, frames {frames}"), "tip", opponent) == pytest.approx(um, rel=0.01)


def test_least_squares_on_a_measured_kuka():
    """Half of the error of A3 is lag, friction and weight; A1 follows too well for that."""
    assert left(("kr300", "A to B"), "A3", "least squares") < 0.5 * left(("kr300", "A to B"), "A3", None)


def test_the_wrist_of_a_measured_kuka_leads_its_set_points():
    """By the time that shifts the set-points onto the encoders, and by least squares of the speed."""
    run = tables.kr300("A")
    for axis, lead_s in (("A4", 0.083), ("A5", 0.137), ("A6", 0.081)):
        t, cmd, act = run["t_s"], run[f"cmd_{axis}_rad"], run[f"act_{axis}_rad"]
        shifts = np.arange(-0.2, 0.2, 0.004)
        misses = [np.mean((act - np.interp(t + s, t, cmd))[60:-60] ** 2) for s in shifts]
        assert shifts[np.argmin(misses)] == pytest.approx(lead_s, abs=0.013)
        assert np.linalg.lstsq(axes.columns(t, cmd, True), act - cmd, rcond=None)[0][0] == pytest.approx(
            lead_s, rel=0.02
        )


def test_a_speed_limit_explains_the_measured_servo():
    nominal = left(("uart_servo", "first to second"), "M", None)
    assert left(("uart_servo", "first to second"), "M", "speed limit") < 0.2 * nominal
    assert left(("uart_servo", "first to second"), "M", "first-order lag") > 0.4 * nominal


def test_a_calibration_finds_the_links_that_are_wrong():
    arm = arms.Arm(tables.HERE / "ur5" / "ur5.yaml")
    rng = np.random.default_rng(3)
    q = rng.uniform(-1.5, 1.5, (200, 6))
    wrong = np.zeros((6, 5))
    wrong[1, 2], wrong[2, 0] = 0.7, 4e-4
    tip = arms.placed(arm.chain(q, wrong)[-1], np.r_[0.1, -0.2, 0.3, 100.0, 50.0, 20.0, 5.0, -3.0, 40.0])
    fit, judged = arms.Poses(q[:150], tip[:150]), arms.Poses(q[150:], tip[150:])
    nominal = arms.residual(arms.Calibration(arm), fit, judged, refit_frame=False, nominal=True)
    found = arms.residual(arms.Calibration(arm), fit, judged, refit_frame=False)
    assert bench.rms(found) < 0.02 * bench.rms(nominal)


def test_a_row_says_whether_camcomp_is_worse_and_whether_its_file_keeps_the_claim():
    row = {"opponents": {"named": 100.0, "lucky": 80.0}, "camcomp": 104.0, "claimed": 104.0, "file": 105.0}
    assert bench.compared(row) == {
        "best": "lucky", "ratio": 1.04, "ratio_to_best": 1.3, "verdict": "worse", "kept": True,
    }  # fmt: skip
    assert bench.compared({**row, "file": 107.0})["kept"] is False
    assert bench.compared({**row, "camcomp": 102.0, "claimed": None})["verdict"] == "equal"
    assert bench.compared({**row, "camcomp": None})["verdict"] == "no answer"
