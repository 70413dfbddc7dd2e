"""Answers on logs of axes, made by a generator that was written from the contract alone."""

import json

import pytest

from tests.validation.axes.make import make
from tests.validation.scoring import SURE, ask, judge, library


def judged(folder, seed):
    make(seed, folder, None)
    truth = json.loads((folder / "truth" / f"e-{seed}.json").read_text())
    result = ask(folder / f"e-{seed}" / "experiment.yaml")
    return result, judge(result, truth, library())


HEALTHY = {
    31005: "axes that stand while others move",
    31010: "lost rows and a coarse encoder",
    31020: "single rows of 40 um while the axis moves",
    31025: "slow runs and a fast one",
}


@pytest.mark.parametrize(
    "seed", [pytest.param(k, id=HEALTHY[k], marks=() if k == 31005 else pytest.mark.campaign) for k in HEALTHY]
)
def test_an_axis_with_nothing_wrong(tmp_path, seed):
    result, _ = judged(tmp_path, seed)
    assert (result["verdict"], result["causes"]) == ("none", []), HEALTHY[seed]


WRONG = {
    31013: "overshoot in a log that begins while the axis moves",
    31018: "a push for a while",
    31021: "one lag of all axes",
    31028: "friction",
    31031: "a lag at one speed, which a reversal explains nearly as well",
    34011: "overshoot with logged forces",
    34012: "friction that differs between the ways, on an axis that goes down and up once",
    37016: "a push on a smooth motion",
    37018: "a push of the run that is held out",
    37027: "overshoot of an axis that moves in two runs of four",
    37041: "a push that the loop answers",
    37043: "a short push at a place passed once",
    37051: "friction behind a spring",
    37057: "one short move in a log of one run",
    35036: "overshoot that looks late on average",
    35041: "jitter of an axis that rests most of the time",
    38007: "overshoot on a steady sine",
    38022: "a push in the middle of friction",
    38026: "jitter",
    37026: "friction of a hundred times the noise, whose shape is known to a hundredth",
    45026: "friction of an axis that moves in one of four runs",
    39028: "friction of an axis that creeps back a little",
    50012: "friction of an axis that stops after it crept back a thousandth of a millimetre",
    50017: "a lag that differs between the ways by a quarter of the floor",
    50026: "heavier tails while the axis stands",
    37052: "one cause on two axes, reversals between rows",
    10000258: "a lag that sizes of every axis explain nearly as well where no cause acts",
    10000167: "a lag beside an overshoot, at first sight a drive at its largest speed after a dead time",
}


IN_CI = (10000167,)
KNOWN = {
    35041: "none: its gap is at the floor",
    39034: "ambiguous: it moves positions by less than their floor",
    39029: "the time is named",
}


def known(seed, name, *marks):
    """A seed, marked where its answer is known to be wrong."""
    wrong = [pytest.mark.xfail(strict=True, reason=KNOWN[seed])] if seed in KNOWN else []
    return pytest.param(seed, id=name, marks=[*marks, *wrong])


@pytest.mark.parametrize("seed", [known(k, WRONG[k], *() if k in IN_CI else [pytest.mark.campaign]) for k in WRONG])
def test_an_axis_with_something_wrong(tmp_path, seed):
    result, row = judged(tmp_path, seed)
    assert result["verdict"] == "identified" and row["all"] and not row["false_cause"], WRONG[seed]


@pytest.mark.parametrize(("seed", "target", "coulomb"), [(90076, "z", 39.7), (90092, "x", 257.5)])
def test_friction_that_turns_round_over_a_distance_has_no_stribeck_part(tmp_path, seed, target, coulomb):
    """The plant's Coulomb friction, N, is the same at all speeds."""
    (friction,) = [c for c in judged(tmp_path, seed)[0]["causes"] if c["target"] == target]
    low, high = friction["parameters"]["force_N"]["ci95"]
    assert low < coulomb < high and "stribeck_N" not in friction["parameters"]


@pytest.mark.campaign
def test_a_cable_at_the_end_of_the_travel_is_no_push(tmp_path):
    """The axis was there once: it may be the place as well as the time."""
    result, row = judged(tmp_path, 33044)
    assert result["verdict"] == "unknown" and not row["false_cause"]


@pytest.mark.campaign
@pytest.mark.parametrize(
    "seed",
    [34009, 52049],
    ids=["a large difference", "a difference of twice the floor"],
)
def test_a_lag_that_differs_between_the_ways_is_unknown_beside_the_lag(tmp_path, seed):
    """An axis without friction: a loop lags equally in both directions. By less than a hundredth of the lag, but twice the floor, too."""
    result, row = judged(tmp_path, seed)
    assert result["verdict"] == "unknown" and row["all"] and not row["false_cause"]
    assert all(0.5 < p <= SURE for _, _, p in row["found"]), "something of any form may be the lag"


@pytest.mark.campaign
@pytest.mark.parametrize(
    "seed",
    [
        known(37024, "fading friction"), known(39034, "an end stop"), known(50014, "a drag behind a loop"),
        known(50059, "play in the loop"),
    ],
)  # fmt: skip
def test_what_takes_a_part_of_something_unknown_is_not_sure(tmp_path, seed):
    """Friction that fades, of which a loop that swings over takes a third; an end stop that two pushes are made of; a drag of
    which a loop that creeps takes some; play in the loop, reported as a friction force at speed.
    """
    result, row = judged(tmp_path, seed)
    assert result["verdict"] == "unknown" and not row["false_cause"]


RESTS = {
    39004: ("time:y", "friction that fades while a run goes on"),
    39029: ("position:y", "a loop whose gain depends on the place"),
    39039: ("acceleration:y", "forces of another axis on this one's"),
    39059: ("reversal:x", "play inside the loop"),
}


@pytest.mark.parametrize("seed", [known(k, RESTS[k][1], *() if k == 39039 else [pytest.mark.campaign]) for k in RESTS])
def test_what_the_rest_depends_on_is_named(tmp_path, seed):
    result, row = judged(tmp_path, seed)
    covariate, fault = RESTS[seed]
    drivers = result["where"]["drivers"]
    assert result["verdict"] == "unknown" and not row["false_cause"], fault
    assert drivers and drivers[0]["covariate"] == covariate, fault
    if covariate == "acceleration:y":
        assert "of z when it moves alone, it goes with how y moves" in result["next_experiment"]["outcomes"][0]


@pytest.mark.campaign
def test_a_drag_that_grows_with_speed_is_neither_friction_that_pushes_nor_surely_a_lag(tmp_path):
    """Friction of -55 N and a viscous part fitted its forces; what its loop makes of it is a lag in the main."""
    result, row = judged(tmp_path, 39014)
    assert result["verdict"] == "unknown" and not row["false_cause"]
    assert "friction" not in [cause["effect"] for cause in result["causes"]]
    assert "velocity:z" in [each["covariate"] for each in result["where"]["drivers"]]
