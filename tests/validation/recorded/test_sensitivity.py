"""The bench that halves and doubles constants separates those that decide from the others."""

import pytest

from tests.validation.recorded import sensitivity


@pytest.mark.campaign  # asks whole experiments again and again
def test_a_constant_that_decides_is_told_from_one_that_does_not_and_from_one_that_is_not_met(tmp_path, monkeypatch):
    gate, listed, milled = (
        ("model.noise", "MINOR"),
        ("axis.plausible", "NEAR"),
        ("search.cause_search", "LEFT_OPEN"),
    )
    for name in ("SET", "AXES", "POSES"):
        monkeypatch.setattr(sensitivity, name, ())
    monkeypatch.setattr(sensitivity, "FACTORS", (1.0, 1e6))
    (axis, _) = sensitivity.written(tmp_path)
    bench = sensitivity.Bench([gate, listed, milled])
    bench.ask(axis)
    assert bench.usual[axis].startswith("unknown friction(x) servo_lag(x)")
    assert (bench.met[gate], bench.met[listed], bench.met[milled]) == (1, 1, 0)
    assert bench.changed[gate] == [0, 1]
