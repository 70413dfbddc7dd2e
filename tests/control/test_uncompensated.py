"""Programs that were recorded without a compensation: sharp corners between lines and arcs, blended in every mode."""

import numpy as np
import pytest

from camcomp.gcode.interpret import read_program
from camcomp.gcode.setup import Setup
from camcomp.ground import path_geometry
from camcomp.ground.datatypes import ARC
from camcomp.model.motion.alignment import align
from camcomp.model.trajectory.moves import ControlLimits, moves_of
from camcomp.model.trajectory.plan import plan_of
from tests.control.measured import passes
from tests.validation.recordings import recording

# The feed override is what no program says.
OVERRIDDEN = (
    "override-blended", "eight-fast", "inward-blended", "diagonal-200um", "pendulum-blended", "speeds-blended", "steep-exact",
)  # fmt: skip
LONGEST_STOP = 2  # cycles
UM, SHARE, TIME = 0.5, 0.1, 0.02
WORST = 1.8  # um, of single corners
APART = ("rests-fast", "perrev-plunges")  # a message, at which LinuxCNC stops; overlaps of G95, 7 um less than modelled


def _moving_s(tip):
    """Seconds that a tip (n, 3) is on its way, and those of its stops, but not those in which the control waits for something."""
    still = np.r_[0, ~np.any(np.diff(tip, axis=0) != 0.0, axis=1), 0]
    begin, end = (np.flatnonzero(np.diff(still) == sign) for sign in (1, -1))
    return (len(tip) - np.maximum(end - begin - LONGEST_STOP, 0).sum()) * recording.STEP_S


def looked_at(name):
    """Seconds in motion and distances (k,) um of end points from the way: recorded and modelled."""
    found = recording.load(name)
    program = read_program(found.program.encode(), name=name, setup=Setup(start_mm=tuple(found.tip[0].tolist())))
    path = program.path
    moving = np.flatnonzero(np.any(np.diff(found.tip, axis=0) != 0.0, axis=1))
    tip = found.tip[moving[0] : moving[-1] + 2]
    motion = np.repeat(np.arange(len(path)), np.where(path.kind == ARC, 40, 1))
    u = np.concatenate([np.arange(1, 41) / 40 if kind == ARC else [1.0] for kind in path.kind])
    places = passes(tip, path_geometry.points(path, motion, u))[u == 1.0]
    velocity, acceleration = recording.limits()
    limits = ControlLimits(acceleration, velocity, 1e-3, 50)
    plan = plan_of(moves_of(path, program.modes, per_turn=program.per_turn), limits)
    every = np.arange(len(path))
    off = [np.linalg.norm(each, axis=1) for each in (places - path.end, plan.leaves_by(every, path.end))]
    return _moving_s(tip), plan.duration_s, 1e3 * off[0], 1e3 * off[1]


def recorded():
    """Set and name of every recording at the speed that its program says."""
    for recordings in recording.SETS:
        with recording.taken_from(recordings):
            for name in sorted(set(recording.names()) - set(OVERRIDDEN)):
                yield recordings, name


@pytest.mark.parametrize(("recordings", "name"), list(recorded()))
def test_corners_and_time_are_those_of_the_control(recordings, name):
    with recording.taken_from(recordings):
        measured, modelled, recorded, predicted = looked_at(name)
    assert modelled == pytest.approx(measured, rel=TIME)
    for figure in (np.max, lambda off: np.sqrt(np.mean(off**2))):
        assert abs(figure(predicted) - figure(recorded)) <= max(UM, SHARE * figure(recorded))
    assert name in APART or np.abs(predicted - recorded).max() < WORST


@pytest.mark.parametrize(
    ("recordings", "name"),
    [("slots", "gear-20um"), ("feed_modes", "circles-blended"), ("feed_modes", "valleys-blended")],
)
def test_every_corner_beside_an_arc_is_rounded_as_the_control_does(recordings, name):
    """Inside the circle and outside of it; a corner of two lines would be up to 30 um off here."""
    with recording.taken_from(recordings):
        _, _, recorded, predicted = looked_at(name)
    assert np.abs(predicted - recorded).max() < UM


def test_a_circle_does_not_end_where_it_was_rounded_to_begin():
    with recording.taken_from("spirals"):
        _, _, recorded, predicted = looked_at("circles-blended")
    assert np.sum(recorded > 9.0) > 1
    assert np.abs(predicted - recorded).max() < UM


@pytest.mark.parametrize("recordings", recording.SETS)
def test_a_control_drives_what_the_program_is_read_as(recordings):
    """Inches, canned cycles, turns and all: of an exact path no point lies beside the program, and no motion of it is left out."""
    with recording.taken_from(recordings):
        for name in (each for each in recording.names() if each.endswith("-exact")):
            found = recording.load(name)
            setup = Setup(start_mm=tuple(found.tip[0].tolist()))
            path = read_program(found.program.encode(), name=name, setup=setup).path
            aligned = align(path, found.tip, np.full(len(found.tip), np.nan))
            assert aligned.distance.max() < 2e-3, name
            assert set(aligned.motion) >= set(np.flatnonzero(path_geometry.lengths(path) > 0.1)), name
