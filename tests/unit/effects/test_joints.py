"""What joints of arms do behind their encoders, against formulas written down anew."""

import numpy as np
import pytest

from camcomp.effects import joint_coupling, joint_curve, joint_hysteresis
from camcomp.ground.errors import ConfigError
from camcomp.model.config.load import load_config
from camcomp.model.effect import Motion

ANGLE = np.radians(np.arange(-400.0, 400.0, 0.5))
ARM = "config/ur10.yaml"


def motion(q, *, ordered=True, way=None):
    n, m = q.shape
    zero, t = np.zeros_like(q), np.arange(float(n))
    return Motion(t, t, t, None, q, zero, zero if way is None else way, np.full(m, 0.25), np.full(m, np.inf), ordered)


def test_a_curve_is_its_fourier_series_and_the_same_every_turn():
    p = {"amplitude_rad": 2e-4, "sine": [0.0, 0.5], "cosine": [0.3, 0.0, 0.0, -1.0]}
    moved = motion(np.column_stack([ANGLE, ANGLE]))
    error = joint_curve.on_drive(np.zeros((len(ANGLE), 2)), moved, np.array([0.0, 1.0]), p)
    expected = 2e-4 * (0.5 * np.sin(2 * ANGLE) + 0.3 * np.cos(ANGLE) - np.cos(4 * ANGLE))
    np.testing.assert_allclose(error[:, 1], expected, atol=1e-15)
    assert not error[:, 0].any()


def test_a_curve_fades_to_zero_outside_of_what_was_seen():
    p = {"amplitude_rad": 1e-4, "sine": [], "cosine": [1.0], "seen_deg": [[170.0, 200.0], [-20.0, 10.0]]}
    whole = joint_curve.on_drive(np.zeros((len(ANGLE), 1)), motion(ANGLE[:, None]), np.ones(1), {**p, "seen_deg": []})
    error = joint_curve.on_drive(np.zeros((len(ANGLE), 1)), motion(ANGLE[:, None]), np.ones(1), p)
    turn = np.degrees(ANGLE) % 360.0
    for low, high in ((170.0, 200.0), (0.0, 10.0), (340.0, 360.0)):
        inside = (turn >= low) & (turn <= high)
        np.testing.assert_allclose(error[inside], whole[inside], atol=1e-18)
    assert not error[(turn > 13.1) & (turn < 166.9)].any()
    half = np.isclose(turn, 11.5)
    np.testing.assert_allclose(error[half], 0.5 * whole[half], rtol=1e-6)
    assert np.abs(np.diff(error[:, 0])).max() < 1e-4 * 0.5 / 2.9  # no step anywhere


def test_a_joint_that_stops_short_stands_half_its_width_behind_its_way():
    way = np.array([[1.0], [-1.0], [0.0]])
    error = joint_hysteresis.on_drive(
        np.zeros((3, 1)), motion(np.zeros((3, 1)), ordered=False, way=way), np.ones(1), {"width_rad": 4e-4}
    )
    assert error[:, 0] == pytest.approx([-2e-4, 2e-4, 0.0])
    there = 1e-3 * np.concatenate([np.arange(0.0, 10.0), np.arange(10.0, 0.0, -1.0)])[:, None]
    error = joint_hysteresis.on_drive(np.zeros((20, 1)), motion(there), np.ones(1), {"width_rad": 4e-4})
    assert error[[5, 15], 0] == pytest.approx([-2e-4, 2e-4])


def test_a_joint_is_dragged_along_by_the_one_in_front():
    q = np.random.default_rng(0).uniform(-2, 2, (5, 3))
    error = joint_coupling.on_drive(np.zeros((5, 3)), motion(q), np.array([1.0, 0.0, 1.0]), {"factor": 0.01})
    np.testing.assert_allclose(error, np.column_stack([np.zeros(5), np.zeros(5), 0.01 * (q[:, 1] - 0.25)]))


@pytest.mark.parametrize(
    ("text", "rule"),
    [
        ("seen_deg: [[10, -10]]", "CC205"),
        ("seen_deg: [[10]]", "CC205"),
        ("sine: [0.1, x]", "CC204"),
        ("waves: [1]", "CC201"),
        ("amplitude_rad: -1", "CC205"),
    ],
)
def test_a_curve_that_is_none_is_refused_where_it_stands(tmp_path, text, rule):
    (tmp_path / "c.yaml").write_text(f"effects:\n  - effect: joint_curve\n    target: elbow\n    {text}\n")
    with pytest.raises(ConfigError) as refused:
        load_config([ARM, tmp_path / "c.yaml"])
    assert refused.value.at.line == 4
    assert refused.value.rule == rule
