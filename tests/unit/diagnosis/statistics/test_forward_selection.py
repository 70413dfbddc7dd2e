"""When a group of columns is taken: it has to be more likely, and it has to leave less."""

import numpy as np
import pytest

from camcomp.diagnosis.arm.forward_selection import take


class Stated:
    """Evidence of one column: log predictive density that it gains, and rms that it leaves of 1."""

    effects = 1

    def __init__(self, density, rms):
        self.density, self.rms = density, rms

    def predict(self, widths):
        taken = widths[0] > 0.0
        return (self.density if taken else 0.0), np.full(4, self.rms**2 if taken else 1.0)


@pytest.mark.parametrize(
    ("density", "rms", "taken"), [(10.0, 0.9, True), (10.0, 0.98, False), (2.5, 0.9, False), (10.0, 1.2, False)]
)
def test_density_alone_takes_nothing_and_neither_does_size(density, rms, taken):
    assert [s.group for s in take(Stated(density, rms), {"a": [0]}).steps] == (["a"] if taken else [])
