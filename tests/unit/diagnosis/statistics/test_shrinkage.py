"""What an interval of the shrinkage is drawn from."""

import numpy as np
import pytest

from camcomp.diagnosis.statistics.shrinkage import shrinkage


def runs(n):
    """n runs of ten seconds, equal as wholes; the gap goes in every other second and stays in the rest."""
    t = np.arange(0.0, 10.0, 0.1)
    return [np.ones(100)] * n, [np.where(np.floor(t + 1e-9) % 2, 1.0, 0.01)] * n, [t + 1e-9] * n


def test_many_runs_are_drawn_whole_and_few_in_blocks():
    whole, blocks = shrinkage(*runs(4)), shrinkage(*runs(3))
    assert whole.ratio == pytest.approx(blocks.ratio) == pytest.approx(1.0 - np.sqrt(0.505))
    assert whole.high - whole.low == pytest.approx(0.0, abs=1e-12)
    assert blocks.high - blocks.low > 0.1
