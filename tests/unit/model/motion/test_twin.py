"""Cached results of a twin belong to its machine: the next one on the same run path works out its own."""

from dataclasses import replace
from gc import collect
from pathlib import Path
from weakref import ref

import numpy as np
import pytest

from camcomp.gcode.interpret import read_program
from camcomp.ground import shelf
from camcomp.model.config.load import load_config
from camcomp.model.cutting.track import lay_track
from camcomp.model.effect import Cause
from camcomp.model.job import Job
from camcomp.model.motion.loaded_structure import Slopes
from camcomp.model.motion.run_path import path_of_program
from camcomp.model.motion.timeline import schedule
from camcomp.model.motion.twin import Twin, twin_of
from camcomp.model.statics.description import Actuator

CONFIG = Path(__file__).parents[4] / "config" / "orthoglide.yaml"
PROGRAM = b"G21 G90 G17\nG0 X10 Y10 Z0\nG1 X40 Y20 F1500\nX10 Y30\nM30\n"


@pytest.fixture(scope="module")
def job():
    return Job(load_config([CONFIG]))


def a_run(job):
    twin, path = twin_of(job), read_program(PROGRAM, name="run").path
    timeline = schedule(path, job.config.control.acceleration_mm_per_s2)
    track, time = lay_track(path, job.conditions), np.arange(0.0, timeline.end, 0.02)
    return path_of_program(twin, "run", timeline, track, time, started=0.0)


def changed(twin, robot, causes=()):
    return Twin(robot=robot, nominal=twin.nominal, origin=twin.origin, rotation=twin.rotation, causes=causes)


def softer(robot):
    return robot.edit(Actuator, lambda each: replace(each, stiffness=0.3 * each.stiffness))


def elsewhere(robot):
    return robot.edit(Actuator, lambda each: replace(each, home=each.home + 50.0))


def cause(name, **values):
    effect = shelf.load("effects", name)
    return Cause(name, effect, "x", {p.name: p.nominal for p in effect.PARAMETERS} | values)


def read(twin, run_path, causes=()):
    """Tip, encoder, drive of a run, read off slopes as simulate and diagnose do."""
    _, solved = twin.sense(run_path, causes)
    reading, _ = twin.sense(run_path, causes, solved=solved, slopes=twin.slopes(run_path, causes, solved))
    return np.concatenate([reading.tip, reading.encoder, reading.drive], axis=1)


MOMENTARY = {
    "disturbance": {"shift_mm": 0.05, "force_N": 30.0, "from_s": 0.3, "to_s": 0.9},
    "screw_cyclic": {"amplitude_mm": 0.02, "pitch_mm": 4.0, "phase_rad": 0.4},
    "screw_growth": {"expansion_ppm_per_K": 200.0},
    "thermal_growth": {"growth_mm_per_K": 0.01},
}


def typical(name):
    return cause(name, **MOMENTARY[name])


SECOND = {
    "softer drives": (softer, cause("friction", force_N=60.0)),
    "another home": (elsewhere, cause("screw_pitch", error_ppm=300.0)),
}


@pytest.mark.parametrize("name", SECOND)
def test_a_second_twin_on_a_used_run_path_reads_as_on_a_fresh_one(job, name):
    change, one = SECOND[name]
    first = changed(twin_of(job), twin_of(job).robot, (one,))
    second = changed(first, change(first.robot), (one,))
    run_path = a_run(job)
    before = read(first, run_path)
    assert np.array_equal(read(second, run_path), read(second, a_run(job)))
    assert np.array_equal(read(first, run_path), before)
    assert np.abs(read(second, run_path) - before).max() > 1e-3


def test_a_copy_of_a_used_twin_with_another_machine_has_not_the_first_ones(job):
    first, run_path = twin_of(job), a_run(job)
    before = read(first, run_path)
    soft = replace(first, robot=softer(first.robot))
    assert np.array_equal(read(soft, run_path), read(changed(first, softer(first.robot)), a_run(job)))
    assert np.abs(read(soft, run_path) - before).max() > 1e-3


@pytest.mark.parametrize("clock_s", [0.0, 0.0034])
@pytest.mark.parametrize("name", MOMENTARY)
def test_instants_about_the_rows_are_enough_where_drives_have_no_memory(job, name, clock_s, monkeypatch):
    one, run_path = [typical(name)], replace(a_run(job), clock_s=clock_s)
    assert len(run_path.around_rows.grid) < 0.25 * len(run_path.grid)
    few = read(twin_of(job), run_path, one)
    monkeypatch.setattr("camcomp.model.signal_path.momentary", lambda causes: False)
    np.testing.assert_allclose(few, read(twin_of(job), run_path, one), rtol=1e-13)


def test_carriages_far_off_their_set_points_move_the_tip_along_the_curve_of_the_machine(job):
    """Beside the structure that is solved where they stand; along a straight line the tip is some 40 um off."""
    twin, run_path = twin_of(job), a_run(job)
    x = cause("joint_offset", offset_mm=4.0)
    far = [x, replace(x, target="y", values={**x.values, "offset_mm": -3.0})]
    _, solved = twin.sense(run_path)
    slopes = twin.slopes(run_path, (), solved)
    tip = twin.sense(run_path, far, solved=solved, slopes=slopes)[0].tip
    np.testing.assert_allclose(tip, read(twin, run_path, far)[:, :3], atol=1e-3)


def test_drives_with_a_memory_see_the_whole_run(job):
    """The place of a reversal between two rows decides the later state of the play."""
    one, run_path = [cause("screw_pitch", error_ppm=300.0), cause("backlash", width_mm=20.0)], a_run(job)
    rows_apart = replace(run_path, time=run_path.time[::9], row_rho=run_path.row_rho[::9])
    assert np.array_equal(read(twin_of(job), run_path, one)[::9], read(twin_of(job), rows_apart, one))


def test_slopes_are_not_taken_for_others_that_are_gone(job):
    """An id separates objects only while they live; the next one may get the same."""
    twin, run_path = twin_of(job), a_run(job)
    _, solved = twin.sense(run_path)
    known, moved = twin.slopes(run_path, (), solved), run_path.row_rho + 0.01
    still = twin.sense(run_path, solved=solved, slopes=known)[0].tip
    away = twin.sense(run_path, solved=solved, slopes=known, measured=moved)[0].tip - still
    for k in range(2, 12):
        slopes = Slopes(
            tip_rho=k * known.tip_rho,
            tip_wrench=known.tip_wrench,
            drive_rho=known.drive_rho,
            drive_wrench=known.drive_wrench,
            at_reference=known.at_reference,
        )
        tip = twin.sense(run_path, solved=solved, slopes=slopes, measured=moved)[0].tip
        del slopes
        assert tip - still == pytest.approx(k * away, abs=1e-9)


def test_what_the_usual_load_adds_is_not_told_of_another_load(job):
    twin, run_path = twin_of(job), a_run(job)
    force = shelf.load("effects", "cutting_force")
    heavy = [Cause("cutting_force", force, None, {"factor": 2.0})]
    _, solved = twin.sense(run_path)
    slopes = twin.slopes(run_path, (), solved)
    first = twin.sense(run_path, heavy, solved=solved, slopes=slopes)[0].tip
    usual = twin.sense(run_path, solved=solved, slopes=slopes)[0].tip
    again = twin.sense(run_path, heavy, solved=solved, slopes=slopes)[0].tip
    assert np.array_equal(again, first) and np.abs(again - usual).max() > 1e-3


def test_places_of_one_reading_are_not_kept(job):
    """A clock that is late reads between other instants every time: a diagnosis does so by the thousand."""
    twin, run_path = twin_of(job), a_run(job)
    clock = shelf.load("effects", "time_sync")
    _, solved = twin.sense(run_path)
    slopes = twin.slopes(run_path, (), solved)
    made = []
    kept = replace(run_path, place=lambda at: made.append(ref(place := run_path.place(at))) or place)
    twin.sense(kept, [Cause("time_sync", clock, None, {"offset_s": 0.002})], solved=solved, slopes=slopes)
    collect()
    assert made and made[-1]() is None
