"""When a program is where: trapezoids by hand."""

import numpy as np
import pytest

from camcomp.ground.datatypes import LINE, RAPID, Path
from camcomp.model.motion.timeline import schedule


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
