"""Rows that no machine has made are told from the rows beside them."""

import numpy as np

from camcomp.diagnosis.fit.outliers import _jumping_off


def test_a_beam_break_is_found_where_the_machine_itself_moves_from_row_to_row():
    """A screw's wave along the whole way, and for a while so quick that it has few rows a turn."""
    rng = np.random.default_rng(6)
    x = rng.normal(0, 0.01, 400)
    x += 0.5 * np.sin(np.arange(400) / 40.0)
    x[40:80] += 0.2 * np.sin(1.2 * np.arange(40))
    assert not _jumping_off(x).any()
    x[[52, 300]] -= 2.0
    assert set(np.flatnonzero(_jumping_off(x))) == {52, 300}
