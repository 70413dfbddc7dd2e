"""What seeking shapes costs, against sums over fine grids of the shapes themselves."""

import numpy as np
import pytest

from camcomp.diagnosis.statistics.shape_evidence import COMMON_LOG, SoughtShape, shape_log_evidence

SPAN = 4.0


def mean_likelihood(at, sd):
    """Of independent shapes of one origin: the mean of their likelihoods, 1 at their best, over all that was possible."""
    common = np.linspace(-SPAN / 2, SPAN / 2, 2001)
    out = np.ones_like(common)
    for a, s in zip(at, sd, strict=True):
        own = np.linspace(a - 8 * s, a + 8 * s, 4001)
        alike = np.exp(-0.5 * ((own - common[:, None]) / COMMON_LOG) ** 2) / COMMON_LOG / np.sqrt(2 * np.pi)
        out *= np.trapezoid(np.exp(-0.5 * ((own - a) / s) ** 2) * alike, own, axis=1)
    return np.log(np.trapezoid(out, common) / SPAN)


@pytest.mark.parametrize(
    ("at", "sd"), [([0.2], [0.02]), ([0.2], [0.3]), ([0.3, 0.2, 0.0], [0.1, 0.2, 0.05]), ([0.9, -0.4, 0.2], [0.1] * 3)]
)
def test_it_is_the_mean_over_all_shapes(at, sd):
    sought = {i: [SoughtShape(a, s**-2, SPAN)] for i, (a, s) in enumerate(zip(at, sd, strict=True))}
    ours = shape_log_evidence([tuple(range(len(at)))], sought)
    assert ours == pytest.approx(mean_likelihood(at, sd), abs=0.15)


def test_shapes_that_the_data_leave_open_cost_nothing_and_those_of_different_origin_are_paid_one_by_one():
    told = {1: [SoughtShape(0.0, 400.0, SPAN)], 2: [SoughtShape(0.5, 400.0, SPAN)], 3: [SoughtShape(0.0, 0.0, SPAN)]}
    one = shape_log_evidence([(1,)], told)
    assert one < -2.5
    assert shape_log_evidence([(3,), (4,)], told) == pytest.approx(0.0, abs=1e-6)
    assert shape_log_evidence([(1,), (2,), (3,)], told) == pytest.approx(2 * one)


def test_shapes_that_contradict_one_another_have_no_one_origin():
    def of(*at):
        return shape_log_evidence([(0, 1, 2)], {i: [SoughtShape(a, 100.0, SPAN)] for i, a in enumerate(at)})

    assert of(0.0, 0.1, -0.1) > of(0.6, -0.6, 0.0) + 1.5
