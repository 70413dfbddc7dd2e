"""Which causes may be no more than a part of something unknown that depends on one thing."""

import pytest

from camcomp.diagnosis.fit.bench import CandidateCause
from camcomp.diagnosis.search.stated import is_part_of_unknown
from camcomp.ground import shelf


@pytest.mark.parametrize(
    ("effect", "target", "depends", "part"),
    [
        ("servo_lag", "y", "velocity:y", True),
        ("servo_lag", None, "velocity:y", True),
        ("servo_lag", "x", "velocity:y", False),
        ("servo_lag", "y", "position:y", False),
        ("servo_lag", "y", "", False),
        ("backlash", "y", "velocity:y", False),
        ("screw_cyclic", "y", "position:x", True),
        ("screw_cyclic", "y", "velocity:y", False),
        ("screw_cyclic", "y", "", False),
    ],
)
def test_a_lag_beside_what_goes_with_its_speed_and_a_wave_beside_what_goes_with_a_place(effect, target, depends, part):
    assert is_part_of_unknown(CandidateCause(effect, target, shelf.load("effects", effect)), depends) == part
