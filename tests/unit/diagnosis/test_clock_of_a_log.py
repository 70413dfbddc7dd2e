"""Times of a log that start again are refused; rows written late or twice are not."""

import numpy as np
import pytest

from camcomp.diagnosis.experiment.log_checks import check_clock
from camcomp.diagnosis.fit.measured import Measured
from camcomp.ground.errors import ConfigError

TIME = 0.01 * np.arange(400)


def log(order, time=TIME):
    """Rows of a log by their numbers, with times of their own."""
    x = np.sin(TIME)[order][:, None] * np.ones(3)
    none = np.full_like(x, np.nan)
    return Measured(
        time=time[order], line=x[:, 0], tip=x, setpoint=x, encoder=x, drive=none, load=none, dyno=none,
        temperature=none[:, 0], tip_sd=none,
    )  # fmt: skip


@pytest.mark.parametrize("back_s", [1.0, 1.005, 0.5])
def test_a_clock_that_starts_again_is_refused_with_its_row(back_s):
    time = np.where(TIME < 2.0, TIME, TIME - back_s)
    with pytest.raises(ConfigError, match="time goes back from 1.99 s") as caught:
        check_clock("log.csv", log(np.arange(400), time))
    assert caught.value.rule == "CC405" and caught.value.at.line == 202


ORDERS = {
    "in order": list(range(400)),
    "two rows exchanged": [*range(100), 101, 100, *range(102, 400)],
    "every pair exchanged": [k ^ 1 for k in range(400)],
    "a block late": [*range(100), *range(150, 200), *range(100, 150), *range(200, 400)],
    "a block twice": [*range(150), *range(100, 400)],
}


@pytest.mark.parametrize("name", ORDERS)
def test_rows_late_or_twice_are_taken(name):
    check_clock("log.csv", log(np.array(ORDERS[name])))
