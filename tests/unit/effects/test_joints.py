"""What joints of arms do behind their encoders, against formulas written down anew."""

from dataclasses import replace

import numpy as np
import pytest

from camcomp.diagnosis.fit.bench import CandidateCause
from camcomp.effects import joint_coupling, joint_curve, joint_hysteresis
from camcomp.ground import shelf
from camcomp.ground.errors import ConfigError
from camcomp.model.config.load import load_config
from camcomp.model.effect import Motion, nominal
from camcomp.model.signal_path import stages_of

ANGLE = np.radians(np.arange(-400.0, 400.0, 0.5))
ARM = "config/ur10.yaml"
BEHIND_THE_MOTOR = [
    name
    for name, effect in shelf.usable("effects", ("none",))
    if effect.TARGET in ("actuator", "either")
    and not getattr(effect, "SLIDES_ONLY", False)
    and stages_of(effect) & {"control", "drive"}
]


def motion(q, *, ordered=True, way=None):
    n, m = q.shape
    zero, t = np.zeros_like(q), np.arange(float(n))
    return Motion(
        time=t,
        common=t,
        cut_min=t,
        temperature=None,
        encoder=q,
        speed=zero,
        direction=zero if way is None else way,
        home=np.full(m, 0.25),
        stiffness=np.full(m, np.inf),
        ordered=ordered,
    )


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


@pytest.mark.parametrize("effect", BEHIND_THE_MOTOR)
def test_what_a_hinge_does_is_sought_in_its_own_units(effect):
    """Sizes that are typical of slides, in mm and N, are out by orders of magnitude in rad and N mm."""
    fitted = CandidateCause(effect, "A1", shelf.load("effects", effect), hinge=True).parameters
    assert not [p.name for p in fitted if p.unit.split("/")[0] in ("mm", "N", "Ns")]


@pytest.mark.parametrize(
    "slide, hinge",
    [
        (("backlash", {"width_mm": 0.02}), {"width_rad": 0.02}),
        (("thermal_growth", {"growth_mm_per_K": 0.01}), {"growth_rad_per_K": 0.01}),
        (("disturbance", {"shift_mm": 0.1, "from_s": 5.0, "to_s": 12.0}), {"shift_rad": 0.1}),
        (("disturbance", {"force_N": 7.0, "from_s": 5.0, "to_s": 12.0}), {"force_Nmm": 7.0}),
        (("friction", {"force_N": 7.0, "presliding_mm": 0.1}), {"force_Nmm": 7.0, "presliding_rad": 0.1}),
    ],
)
def test_a_hinge_follows_the_law_of_a_slide(slide, hinge):
    name, values = slide
    there = motion(np.concatenate([np.linspace(0.0, 1.0, 20), np.linspace(1.0, 0.0, 20)])[:, None])
    there = replace(there, stiffness=np.array([1e3]))
    effect, zero = shelf.load("effects", name), np.zeros((40, 1))
    instants = {key: value for key, value in values.items() if key.endswith("_s")}
    asked = [{**nominal(effect), **values}, {**nominal(effect), **instants, **hinge}]
    both = [effect.on_drive(zero, there, np.ones(1), p) for p in asked]
    assert np.ptp(both[0]) > 0.0 and np.array_equal(*both)
