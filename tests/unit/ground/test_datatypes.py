import numpy as np
import pytest

from camcomp.ground.datatypes import Path, frozen


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
