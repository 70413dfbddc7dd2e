"""Neighbouring rows are averaged, whichever way is the faster one."""

import numpy as np
import pytest

from camcomp.diagnosis.fit.bench import thinned


@pytest.mark.parametrize("columns", [1, 3, 100])
@pytest.mark.parametrize("factor", [1, 2, 5])
def test_rows_are_averaged_and_the_rest_is_left_out(columns, factor):
    values = np.random.default_rng(1).normal(size=(17, columns))
    values[6, 0] = np.nan
    out = thinned(values.copy(), factor)
    wanted = [values[at : at + factor].sum(axis=0) / factor for at in range(0, 17 - factor + 1, factor)]
    np.testing.assert_allclose(out, wanted, rtol=1e-13)
