"""Lines at one frequency, on made-up gaps: found where they are, and not where they are not."""

import numpy as np
import pytest

from camcomp.diagnosis.statistics import places
from camcomp.diagnosis.statistics.periods import frequencies

NAMES = ("x", "y", "z")


def run(seed, gap=None, feed=10.0, noise=0.001):
    """A circle of 25 mm at `feed` mm/s with white noise, and an addition to the gap at the tip."""
    rng = np.random.default_rng(seed)
    t = np.linspace(0.0, 2 * np.pi * 25.0 / feed, 400)
    found = noise * rng.standard_normal((400, 3)) + (0.0 if gap is None else gap(t))
    return places.RunGap(
        name="r", gap=found, noise=np.full(3, noise), thin=1.0, time=t, line=np.full(400, 5.0), drives=found
    )


def test_a_vibration_is_found_in_runs_of_different_speed():
    def shake(t):
        return 0.005 * np.sin(2 * np.pi * 1.3 * t)[:, None] * [0.0, 0.0, 1.0]

    [line] = frequencies([run(1, gap=shake), run(2, gap=shake, feed=20.0)], NAMES)
    assert line["axis"] == "z"
    assert line["hertz"] == pytest.approx(1.3, rel=0.02)
    assert line["amplitude_um"] == pytest.approx(5.0, rel=0.1)


def test_what_repeats_with_the_path_is_no_vibration():
    def lobes(feed):
        return lambda t: 0.005 * np.sin(6 * feed * t / 25.0)[:, None] * [1.0, 0.0, 0.0]

    runs = [run(i, gap=lobes(f), feed=f) for i, f in enumerate((8.0, 12.0, 20.0))]
    assert frequencies(runs, NAMES) == []


@pytest.mark.parametrize("seed", range(8))
def test_noise_has_no_lines(seed):
    runs = [run(10 * seed + i, feed=10.0 + 5 * i) for i in range(3)]
    assert frequencies(runs, NAMES) == [] and places.lines(runs) == [] and places.intervals(runs) == []
