import numpy as np
import pytest

from camcomp.ground.datatypes import Path, frozen
from camcomp.ground.orientation import RPY, Orientation


def path(n=2, **changes):
    point = np.arange(3.0 * n).reshape(n, 3)
    fields = {
        **{name: np.zeros(n) for name in ("kind", "angle", "feed", "speed", "turn", "tool")},
        **{name: np.zeros((n, 3)) for name in ("centre", "axis")},
        **{name: np.ones(n, bool) for name in ("known", "machine")},
        "line": np.arange(1, n + 1),
        "start": point,
        "end": point + 1,
    }
    return Path(**{**fields, **changes})


def test_arrays_are_read_only_and_the_callers_are_not():
    mine = np.zeros((2, 3))
    made = path(start=mine)
    with pytest.raises(ValueError, match="read-only"):
        made.start[0, 0] = 1.0
    mine[0, 0] = 1.0
    assert made.kind.dtype == np.int8 and made.known.dtype == np.bool_


@pytest.mark.parametrize("field", ["end", "angle", "known"])
def test_a_row_missing_is_refused(field):
    with pytest.raises(ValueError, match=field):
        path(**{field: getattr(path(), field)[:1]})


def test_take_picks_motions():
    some = path(3).take(np.array([False, True, True]))
    assert len(some) == 2
    assert some.line.tolist() == [2, 3]


def test_frozen_keeps_the_number_of_dimensions():
    assert frozen(1.5).shape == ()


def test_records_in_records_are_taken_and_joined_with_them():
    oriented = path(3, orientation=Orientation(RPY, np.zeros((3, 3)), np.arange(9.0).reshape(3, 3)))
    some = oriented.take([0, 2])
    both = Path.joined([some, oriented])
    assert len(both) == 5 and both.orientation.form == RPY
    assert both.orientation.end[:, 0].tolist() == [0.0, 6.0, 0.0, 3.0, 6.0]
    assert Path.joined([path(1), path(2)]).orientation is None
