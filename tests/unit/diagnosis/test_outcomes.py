"""What outcomes of a proposed experiment mean, in sentences."""

from types import SimpleNamespace

import numpy as np
import pytest

from camcomp.diagnosis.next_experiment.designed import NEITHER, outcomes_of
from camcomp.diagnosis.next_experiment.information_gain import ExpectedGain
from camcomp.diagnosis.next_experiment.predicted_logs import ONLY_NOISE


def outcomes(names, apart, left, *, knows=()):
    r = len(names)
    told = ExpectedGain(
        separated=0.5,
        narrowed=0.1,
        before_um=2.6,
        after_um=1.2,
        kind="tip",
        shows=np.full(r, 0.034),
        left=np.array(left),
        apart=np.array(apart),
    )
    return outcomes_of(told, SimpleNamespace(knows=knows), names)


@pytest.fixture
def three():
    """The first two are indistinguishable, the third differs."""
    apart = [[0, 0.5, 90], [0.5, 0, 90], [90, 90, 0]]
    left = [[0, 7e-7, 0.02], [7e-7, 0, 0.02], [0.02, 0.019, 0]]
    return outcomes(["joint_offset (A2)", "chain_error (A2)", "gravity"], apart, left)


def test_what_looks_alike_is_said_to_and_no_size_is_made_up(three):
    assert (
        three[0]
        == "If it is joint_offset (A2), the tip is off by 34 µm (rms) on it; chain_error (A2) would look the same there."
    )
    assert (
        three[2]
        == "If it is gravity, the tip is off by 34 µm (rms) on it, of which chain_error (A2) cannot explain 19 µm."
    )
    assert three[-1] == NEITHER and not any("e-" in each or "0.000" in each for each in three)


def test_nothing_but_noise_is_an_outcome_too():
    first, second, _ = outcomes(["backlash (x)", ONLY_NOISE], [[0, 30], [30, 0]], [[0, 0.01], [0.01, 0]])
    assert (
        first.startswith("If it is backlash (x)") and second == "If nothing but noise is left on it, there is no cause."
    )


def test_one_set_of_causes_is_held_against_the_noise():
    first, second = outcomes(["friction (y) and screw_pitch (x)"], [[0]], [[0]])
    assert first.startswith(
        "If no more than the noise is left on it with friction (y) and screw_pitch (x) in the model, that holds"
    )
    assert "1.2 µm (rms) on the runs' programs instead of 2.6 µm" in first and second.startswith("If more is left")


def test_what_is_measured_by_hand_has_the_outcomes_of_a_gauge():
    told = outcomes(
        ["tool_length", "workpiece_frame"],
        [[0, 9], [9, 0]],
        [[0, 0], [0, 0]],
        knows=(("tool_length", "length_mm", 0.003),),
    )
    assert "off by what tool_length says" in told[0] and "--without tool_length" in told[1]
