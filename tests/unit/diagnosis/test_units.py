"""Units of recordings: each factor against SI, and times since 1970 by their size."""

import numpy as np
import pytest

from camcomp.diagnosis.recordings.units import factor_to, seconds

FACTORS = [  # column of a log, unit of theirs, what one of theirs is in the log's unit
    ("act_x_mm", "m", 1000.0),
    ("act_x_mm", "mm", 1.0),
    ("act_x_mm", "µm", 0.001),
    ("act_x_mm", "um", 0.001),
    ("act_x_mm", "in", 25.4),
    ("act_A1_rad", "rad", 1.0),
    ("act_A1_rad", "mrad", 0.001),
    ("act_A1_rad", "deg", 0.017453292519943295),
    ("t_s", "ms", 0.001),
    ("t_s", "us", 1e-6),
    ("t_s", "µs", 1e-6),
    ("t_s", "ns", 1e-9),
    ("t_s", "min", 60.0),
    ("fx_N", "kN", 1000.0),
    ("act_A1_Nmm", "Nm", 1000.0),
    ("act_A1_Nmm", "N·m", 1000.0),
    ("act_A1_Nmm", "N.m", 1000.0),
    ("act_A1_Nmm", "N*m", 1000.0),
    ("act_A1_Nmm", "Nmm", 1.0),
]


@pytest.mark.parametrize(("column", "unit", "factor"), FACTORS)
def test_a_unit_leads_to_that_of_the_log(column, unit, factor):
    assert factor_to(column, unit) == pytest.approx(factor, rel=1e-12)


@pytest.mark.parametrize("per_second", [1.0, 1e3, 1e6], ids=["s", "ms", "us"])
def test_times_since_1970_are_seconds_whatever_they_count(per_second):
    """2024-05-01 12:00 and 20 rows 4 ms apart, as whole counts but for seconds."""
    times = 1714564800.0 + 0.004 * np.arange(20)
    read = seconds(times * per_second if per_second == 1.0 else np.round(times * per_second), None)
    np.testing.assert_allclose(np.diff(read), 0.004, rtol=1e-3)
