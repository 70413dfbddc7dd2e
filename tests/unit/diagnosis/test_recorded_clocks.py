"""Dates and times of day in cells of a recording as seconds."""

import pytest

from camcomp.diagnosis.recordings.tables import read_text_table
from camcomp.diagnosis.recordings.units import clock
from camcomp.ground.errors import ConfigError


@pytest.mark.parametrize(
    ("text", "due"),
    [
        ("11.10.2022 15:06:48.043", 43.0),
        ("2022-10-11T15:06:48,043Z", 43.0),
        ("15:06:48", 43.0),
        ("1665500848000000000", 43.0),
        ("10/11/2022 15:06:48", None),
        ("31.02.2022 15:06:48", None),
        ("48.043", None),
    ],
)
def test_clocks_are_read_as_seconds(text, due):
    found, start = clock(text), clock(text.replace("48", "05"))
    assert (found is None) if due is None else found - start == pytest.approx(due, abs=1e-6)


def test_a_clock_that_breaks_off_is_refused_with_its_place():
    with pytest.raises(ConfigError, match="no date or time like the cells above it") as caught:
        read_text_table(b"Time;x\n15:06:48;1\n7;2\n", "a.csv")[0].read(0)
    assert (caught.value.rule, caught.value.at.line) == ("CC422", 3)


def test_dates_and_ns_since_1970_have_one_origin():
    assert clock("1665500848000000000") == clock("2022-10-11T15:07:28Z") == 718_816_048.0
