"""The step-over test keeps few samples of a long path, whatever its parts, and counts as it does with all of them."""

from dataclasses import replace

import numpy as np
import pytest

from camcomp.ground.datatypes import LINE
from camcomp.model.cutting import assumed
from tests.paths import path_of


def raster(rows, step):
    """Rows of 100 lines of 1 mm, `step` mm apart, as points (n, 3)."""
    k = np.arange(rows * 100)
    row, x = k // 100, k % 100
    return np.column_stack((np.where(row % 2, 99 - x, x), row * step, np.full(len(k), -1.0)))


def share(points, part, diameter):
    passes, n = assumed.Passes(), len(points) - 1
    whole = path_of(*(("line", (0.0, 0.0, 0.0)) for _ in range(n)), start=(0, 0, 0))
    whole = replace(whole, start=points[:-1], end=points[1:], kind=np.full(n, LINE, np.int8))
    for a in range(0, n, part):
        some = whole.take(np.arange(a, min(n, a + part)))
        passes.add(some, np.arange(len(some)), np.full(len(some), diameter))
    return passes.beside_share(), len(passes.along)


@pytest.mark.parametrize(("step", "wanted"), [(4.0, 59 / 60 * 0.9), (12.0, 0.0)])
def test_few_samples_are_as_good_as_all(monkeypatch, step, wanted):
    """wanted: of all rows but the first, without the 7 to 12 mm behind a turn that are within 3 diameters of path."""
    points = raster(60, step)
    exact, many = share(points, 10_000, 8.0)
    monkeypatch.setattr(assumed, "MOST_SAMPLES", 600)
    whole, few = share(points, 10_000, 8.0)
    parts, same = share(points, 700, 8.0)
    assert many > 1400 and few <= 600 and abs(few - same) <= 2
    assert exact == pytest.approx(wanted, abs=0.026) and whole == pytest.approx(exact, abs=0.15)
    assert parts == pytest.approx(whole, abs=0.01)
