"""Programs that were recorded without a compensation: sharp corners between lines and arcs, blended in every mode."""

import numpy as np
import pytest

from camcomp.gcode.interpret import read_program
from camcomp.gcode.setup import Setup
from camcomp.ground import path_geometry
from camcomp.ground.datatypes import ARC
from camcomp.model.trajectory.moves import ControlLimits, moves_of
from camcomp.model.trajectory.plan import plan_of
from tests.control.measured import passes
from tests.recordings import recording
from tests.recordings.record import ACCELERATION, VELOCITY

STOPPED = ("dwell-exact", "pause-blended", "override-blended")  # what the program does not say
UM, SHARE, TIME = 0.5, 0.2, 0.05


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
    plan = plan_of(moves_of(path, program.modes), ControlLimits(ACCELERATION, VELOCITY, 1e-3, 50))
    every = np.arange(len(path))
    off = [np.linalg.norm(each, axis=1) for each in (places - path.end, plan.leaves_by(every, path.end))]
    return len(tip) * recording.STEP_S, plan.duration_s, 1e3 * off[0], 1e3 * off[1]


@pytest.mark.parametrize("name", sorted(set(recording.names()) - set(STOPPED)))
def test_corners_and_time_are_those_of_the_control(name):
    measured, modelled, recorded, predicted = looked_at(name)
    assert modelled == pytest.approx(measured, rel=TIME)
    for figure in (np.max, lambda off: np.sqrt(np.mean(off**2))):
        assert abs(figure(predicted) - figure(recorded)) <= max(UM, SHARE * figure(recorded))
