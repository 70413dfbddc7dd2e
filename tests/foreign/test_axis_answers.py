"""What camcomp says of logs of axes by a generator that was written from the contract alone: what it has shown."""

import json

import pytest

from tests.foreign.axes.make import make
from tests.trials.score import ask, judge, library


def judged(folder, seed):
    make(seed, folder, None)
    truth = json.loads((folder / "truth" / f"e-{seed}.json").read_text())
    result = ask(folder / f"e-{seed}" / "experiment.yaml")
    return result, judge(result, truth, library())


HEALTHY = {
    31005: "axes that stand beside others: their columns were taken for exchanged",
    31010: "lost rows and a coarse encoder: accelerations were off by what cubics made of the gaps",
    31020: "single rows of 40 um while the axis moves",
    31025: "inertia fitted to the noise of encoders in slow runs, told to a fast one",
}


@pytest.mark.parametrize("seed", [pytest.param(k, marks=() if k == 31005 else pytest.mark.campaign) for k in HEALTHY])
def test_an_axis_with_nothing_wrong(tmp_path, seed):
    result, _ = judged(tmp_path, seed)
    assert (result["verdict"], result["causes"]) == ("none", []), HEALTHY[seed]


WRONG = {
    31013: "a loop that swings over, in a log that begins while the axis moves",
    31018: "a push for a while: it was unknown",
    31021: "one lag of all axes",
    31028: "friction, whose sense cubics turned round before every stop",
    31031: "a lag at one speed, which a reversal explains nearly as well",
    37026: "friction of a hundred times the noise, whose shape is known to a hundredth",
    37052: "the same on two axes, where reversals fall between two rows",
}


@pytest.mark.parametrize(
    "seed", [pytest.param(k, marks=() if k in (31018, 31031, 37026) else pytest.mark.campaign) for k in WRONG]
)
def test_an_axis_with_something_wrong(tmp_path, seed):
    result, row = judged(tmp_path, seed)
    assert result["verdict"] == "identified" and row["all"] and not row["false_cause"], WRONG[seed]


@pytest.mark.campaign
def test_a_cable_at_the_end_of_the_travel_is_no_push(tmp_path):
    """The axis was there once: it may be the place as well as the time."""
    result, row = judged(tmp_path, 33044)
    assert result["verdict"] == "unknown" and not row["false_cause"]
