"""When a program is where: trapezoids by hand, and what a log may say against them."""

import numpy as np
import pytest

from camcomp.ground.datatypes import LINE, RAPID, Path
from camcomp.model.motion.timeline import fit_to_log, schedule


def lines(points, feed, kinds=None):
    p = np.array(points, float)
    n = len(p) - 1
    nan = np.full((n, 3), np.nan)
    return Path(
        line=np.arange(10, 10 + n), kind=np.array(kinds or [LINE] * n), start=p[:-1], end=p[1:], centre=nan, axis=np.zeros((n, 3)),
        angle=np.zeros(n), feed=np.full(n, feed), speed=np.zeros(n), turn=np.ones(n), tool=np.zeros(n), known=np.ones(n, bool),
        machine=np.zeros(n, bool),
    )  # fmt: skip


def test_a_line_takes_length_over_feed_plus_one_ramp():
    timeline = schedule(lines([[0, 0, 0], [60, 0, 0]], 600.0), 1500.0)
    assert timeline.end == pytest.approx(60 / 10 + 10 / 1500)


def test_a_short_line_never_reaches_its_feed():
    timeline = schedule(lines([[0, 0, 0], [0.015, 0, 0]], 600.0), 1500.0)
    assert timeline.end == pytest.approx(2 * np.sqrt(0.015 / 1500))


def test_half_way_through_a_ramp_a_quarter_of_it_is_done():
    timeline = schedule(lines([[0, 0, 0], [60, 0, 0]], 6000.0), 1500.0)
    ramp = 100 / 1500
    _, share = timeline.locate(np.array([ramp / 2, ramp, timeline.end - ramp, timeline.end]))
    assert share * 60 == pytest.approx([0.25 * 0.5 * 100 * ramp, 0.5 * 100 * ramp, 60 - 0.5 * 100 * ramp, 60])


def test_rapids_take_no_time_and_the_first_feed_move_starts_at_zero():
    path = lines([[0, 0, 9], [0, 0, 0], [60, 0, 0]], 600.0, [RAPID, LINE])
    assert schedule(path, 1500.0).start.tolist() == [0.0]


def test_a_log_that_agrees_leaves_the_timeline_alone():
    path = lines([[0, 0, 0], [20, 0, 0], [20, 20, 0]], 600.0)
    timeline = schedule(path, 1500.0)
    t = np.arange(0.0, timeline.end, 0.02)
    line = np.where(t < timeline.start[1], 10.0, 11.0)
    assert fit_to_log(timeline, t, line).timeline is timeline


def test_a_pause_between_lines_moves_the_second_one():
    path = lines([[0, 0, 0], [20, 0, 0], [20, 20, 0]], 600.0)
    timeline = schedule(path, 1500.0)
    t = np.arange(0.0, timeline.end + 1.0, 0.02)
    line = np.where(t < timeline.start[1] + 1.0, 10.0, 11.0)
    fit = fit_to_log(timeline, t, line)
    assert not fit.as_expected and fit.timeline.start[1] == pytest.approx(timeline.start[1] + 1.0, abs=0.02)


def test_rows_of_foreign_lines_are_told():
    timeline = schedule(lines([[0, 0, 0], [20, 0, 0]], 600.0), 1500.0)
    t = np.linspace(0, 1, 10)
    assert not fit_to_log(timeline, t, np.full(10, 99.0)).rows.any()
