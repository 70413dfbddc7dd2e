"""What diagnosis has to know of a control: which lines it merged, and that rows beside its stops do not say how fast it was."""

import numpy as np

from camcomp.gcode.interpret import read_program
from camcomp.gcode.setup import Setup
from camcomp.ground.files import shipped
from camcomp.model.config.load import load_config
from camcomp.model.cutting.track import lay_track
from camcomp.model.job import Job
from camcomp.model.motion.alignment import align
from camcomp.model.motion.driven_path import cutting_forces
from camcomp.model.trajectory.segments import merged
from tests.validation.recordings import recording

ROW = 20  # ms


def recorded(name):
    with recording.taken_from("rosettes"):
        found = recording.load(name)
    return found, read_program(found.program.encode(), name=name, setup=Setup(start_mm=tuple(found.tip[0].tolist())))


def off(path, found, kind):
    """Distances (n,) um of a recorded tip, on its feeds, from a path."""
    rows = found.kind == kind
    return 1e3 * align(path, found.tip[rows], np.full(rows.sum(), np.nan)).distance


def test_a_control_drives_the_lines_that_it_merged():
    found, program = recorded("saddle-50um")
    way = merged(program.path, program.modes)
    feeds = 2  # LinuxCNC's kind of motion
    assert np.median(off(program.path, found, feeds)) > 8.0
    assert np.median(off(way, found, feeds)) < 1.0


def test_where_nothing_is_merged_there_is_no_other_path():
    for name in ("comb-fast", "squircle-exact", "circles-blended"):
        _, program = recorded(name)
        assert merged(program.path, program.modes) is None


def test_forces_beside_stops_are_known_to_what_the_speed_there_leaves_open():
    """Rows of every millisecond determine the force; one row in twenty does not."""
    found, program = recorded("squircle-exact")
    track = lay_track(program.path, Job(load_config([shipped("config/router.yaml")])).conditions)
    rests = np.array([mode.exact for mode in program.modes])

    def forces(every, stops):
        tip, time = found.tip[::every], found.t[::every]
        lines = np.full(len(tip), np.nan)
        return cutting_forces(track, align(program.path, tip, lines), tip, time, stops, logged_line=False)

    true, rows, blind = forces(1, rests), forces(ROW, rests), forces(ROW, np.zeros(len(rests), bool))
    wrong = np.linalg.norm(rows.force - true.force[::ROW], axis=1)
    cut = rows.cutting & true.cutting[::ROW]
    known, thought = (np.mean(wrong[cut] < np.linalg.norm(each.doubt, axis=1)[cut] + 1.0) for each in (rows, blind))
    assert known > 0.98 and thought < 0.93


def test_a_stop_of_a_motion_that_no_row_is_on_is_doubt_as_well():
    """Lines of 1 mm between rows a tenth of a second apart: where only some motions end at rest, rows beside these are in doubt."""
    found, program = recorded("squircle-exact")
    track = lay_track(program.path, Job(load_config([shipped("config/router.yaml")])).conditions)
    tip, time = found.tip[:: 5 * ROW], found.t[:: 5 * ROW]
    aligned = align(program.path, tip, np.full(len(tip), np.nan))
    passed = np.setdiff1d(np.arange(aligned.motion.min(), aligned.motion.max()), aligned.motion)
    assert len(passed) > 20
    rests = np.isin(np.arange(len(program.path)), passed)
    none, some = (
        cutting_forces(track, aligned, tip, time, stops, logged_line=False) for stops in (rests & False, rests)
    )
    more = np.linalg.norm(some.doubt, axis=1) - np.linalg.norm(none.doubt, axis=1)
    assert np.all(more >= 0.0) and np.sum(more[none.cutting] > 1.0) > 10
