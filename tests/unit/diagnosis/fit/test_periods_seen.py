"""Travel below one and a half pitches is no evidence of a screw."""

from types import SimpleNamespace

import numpy as np
import pytest

from camcomp.diagnosis.fit.bench import CandidateCause
from camcomp.diagnosis.fit.grid_parameters import longest
from camcomp.ground import shelf


def bench(*ways):
    """Runs in which the drives x and y go some way (n, 2), mm."""
    return SimpleNamespace(
        actuators=("x", "y"),
        nominal=[SimpleNamespace(motion=SimpleNamespace(encoder=np.asarray(way, dtype=float))) for way in ways],
    )


def pitch(target):
    candidate = CandidateCause("screw_cyclic", target, shelf.load("effects", "screw_cyclic"))
    return candidate, next(p for p in candidate.shapes if p.name == "pitch_mm")


def test_a_pitch_ends_where_all_runs_together_hold_it_one_and_a_half_times():
    runs = bench([[0, 5], [20, 5]], [[10, 5], [30, 8]])
    assert longest(runs, *pitch("x")) == pytest.approx(20.0)
    assert longest(runs, *pitch("y")) == pytest.approx(2.0)


def test_a_long_way_shows_every_pitch_that_a_screw_can_have():
    candidate, p = pitch("x")
    assert longest(bench([[0, 0], [5000, 0]]), candidate, p) == p.high


def test_shapes_that_are_no_periods_end_at_their_own_bound():
    candidate = CandidateCause("servo_overshoot", "x", shelf.load("effects", "servo_overshoot"))
    p = next(each for each in candidate.shapes if each.name == "damping")
    assert longest(bench([[0, 0], [1, 0]]), candidate, p) == p.high
