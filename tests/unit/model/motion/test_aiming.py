"""Commands along a way on which a drive with play turns round: which points are solved, and what is left."""

import numpy as np
import pytest

from camcomp.effects import servo_overshoot
from camcomp.ground.files import shipped
from camcomp.model.config.load import load_config
from camcomp.model.job import Job
from camcomp.model.motion import response
from camcomp.model.motion.response import SETTLED_MM, LatestSolutions, aim_at, respond
from camcomp.model.motion.travel import Travel

POINTS, STANDS = 200, 101
PLAY = "effects: [{effect: backlash, target: x, width_mm: 0.02}]\nprocess: {force: {model: none}}\n"
LOOP = "effects: [{effect: servo_overshoot, period_ms: 600, damping: 0.7}]\nprocess: {force: {model: none}}\n"


def jobs(directory, effects):
    (directory / "effects.yaml").write_text(effects)
    return Job(load_config([shipped("config/orthoglide-1deg.yaml"), directory / "effects.yaml"]))


def along_x(x):
    """Targets along X and their travel, a second apart."""
    target = np.column_stack((x, np.full(POINTS, 20.0), np.zeros(POINTS)))
    none = np.zeros(POINTS)
    return target, Travel(force=np.zeros((POINTS, 3)), time=np.arange(POINTS) * 1.0, cut_min=none, stop=none > 0.0)


@pytest.fixture
def solved(monkeypatch):
    """Numbers of points of all solutions that are asked for."""
    sizes, solve = [], response.solve
    monkeypatch.setattr(
        response,
        "solve",
        lambda machine, mode, near, **more: sizes.append(len(near)) or solve(machine, mode, near, **more),
    )
    return sizes


def test_a_drive_that_stands_in_its_play_does_not_have_all_points_solved_again(tmp_path, solved):
    job = jobs(tmp_path, PLAY)
    x = np.linspace(10.0, 30.0, POINTS)
    x[STANDS] = x[STANDS - 1] - 1e-4  # a reversal too small to be led through the play
    target, travel = along_x(x)
    found = aim_at(job, target, travel, "newton")
    assert len(solved) > 30, "that point takes all steps"
    assert sum(solved) < 10 * POINTS
    tip, _ = respond(job, found.commanded, travel)
    left = np.abs(target - tip).max(axis=1)
    assert np.delete(left, STANDS).max() < SETTLED_MM < left[STANDS]


def test_an_oscillating_loop_without_inverse_has_all_points_solved_in_every_step(tmp_path, solved, monkeypatch):
    monkeypatch.delattr(servo_overshoot, "invert_servo")
    job = jobs(tmp_path, LOOP)
    target, travel = along_x(
        10.0 + np.arange(POINTS) * 0.1 * (np.arange(POINTS) > STANDS)
    )  # the half that stands is met
    aim_at(job, target, travel, "newton")
    assert set(solved) == {POINTS}


@pytest.mark.parametrize(
    "loop",
    [
        "servo_lag, time_constant_ms: 50",
        "servo_overshoot, period_ms: 40, damping: 0.4",
    ],
)
def test_a_loop_with_an_inverse_has_no_more_points_solved(tmp_path, solved, loop):
    target, travel = along_x(20.0 + 10.0 * np.sin(0.05 * np.arange(POINTS)))
    asked = []
    for more in ("", f", {{effect: {loop}}}"):
        solved.clear()
        job = jobs(tmp_path, PLAY.replace("}]", f"}}{more}]"))
        found = aim_at(job, target, travel, "newton")
        asked.append(sum(solved))
    assert asked[0] == asked[1] > 0
    left = target - respond(job, found.commanded, travel)[0]
    assert np.abs(left).max() < 1e-4


def test_answers_are_those_of_all_inputs_and_only_changed_ones_are_asked_for():
    asked = []

    def doubled(near, force):
        asked.append(len(near))
        return 2.0 * near + force

    near, force, latest = np.arange(12.0).reshape(4, 3), np.ones((4, 3)), LatestSolutions()
    for rows in ([], [2], [0, 3], [0, 1, 2, 3]):
        near, force = near.copy(), force.copy()
        near[rows[:1]] += 1.0
        force[rows[1:]] -= 1.0
        assert (latest.of("doubled", doubled, near=near, force=force) == 2.0 * near + force).all()
    assert asked == [4, 1, 2, 4]
