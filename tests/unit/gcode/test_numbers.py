"""Numbers as controls read them."""

import pytest

from camcomp.gcode.numbers import decimals, plain, significant


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [
        (25.0, 4, "25.0"),
        (25.01, 4, "25.01"),
        (-0.00004, 4, "0.0"),
        (-0.5, 1, "-0.5"),
        (1234567.8, 3, "1234567.8"),
        (1e-7, 4, "0.0"),
        (3.0, 0, "3.0"),
        (1e6, 0, "1000000.0"),
    ],
)
def test_plain(value, digits, text):
    assert plain(value, digits) == text


@pytest.mark.parametrize(("value", "text"), [(600.0, "600"), (333.33333, "333.333"), (0.125, "0.125"), (0.0, "0")])
def test_feeds_have_six_digits(value, text):
    assert significant(value) == text


@pytest.mark.parametrize(
    ("resolution", "unit", "digits"), [(1e-3, 1.0, 3), (1e-4, 1.0, 4), (1e-4, 25.4, 6), (5e-4, 1.0, 4), (1.0, 1.0, 0)]
)
def test_decimals_are_not_coarser_than_the_resolution(resolution, unit, digits):
    assert decimals(resolution, unit) == digits
    assert 10.0**-digits * unit <= resolution * (1 + 1e-9)
