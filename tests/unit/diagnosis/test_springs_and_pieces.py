"""Intervals of springs and forces, and the rows that a temporary cause needs."""

from types import SimpleNamespace

import numpy as np
import pytest

from camcomp.diagnosis.fit.cause_sets import Fitted
from camcomp.diagnosis.fit.intervals import FORMULA, STATED, joint_covariance
from camcomp.diagnosis.search.unknown import followed
from camcomp.diagnosis.statistics.by_channel import ByChannel
from camcomp.diagnosis.statistics.evidence import Prior


def deviation_of_force(apart, *, log=True):
    """Standard deviation of log force where a softer link does the same but for a share `apart` of it."""
    rng = np.random.default_rng(4)
    D = 100.0 * rng.standard_normal((3000, 2))
    D[:, 1] = np.sqrt(1.0 - apart**2) * D[:, 0] + apart * D[:, 1]
    r = 0.1 * D[:, 0] + rng.standard_normal(len(D))
    one = np.ones(2)
    parameter = SimpleNamespace(log=log, scale=0.3)
    problem = SimpleNamespace(
        prior=Prior(1e-3 * one, 0.0 * one, 4e-3 * one),
        columns=SimpleNamespace(candidates=[SimpleNamespace(parameters=(parameter,))] * 2, names="ab"),
        candidates=SimpleNamespace(columns=((0,), (1,))),
        member_columns=list, shapes_of=lambda members: [], row_places=lambda k: np.linspace(0.0, 1.0, len(r)),
        white_at=lambda f: [ByChannel.of([D])],
    )  # fmt: skip
    fit = Fitted(
        members=(0,),
        theta=np.array([0.1]),
        log_evidence=0.0,
        grams=(),
        white=(D[:, :1],),
        residual=(r,),
    )
    return 0.3 * np.sqrt(joint_covariance(problem, fit)[0, 0])


def test_a_force_is_known_no_better_than_the_spring_that_it_bends():
    assert deviation_of_force(1e-4) == pytest.approx(STATED, rel=0.15)


def test_rows_that_tell_force_and_spring_apart_say_it_better():
    """Error of the formula of a whole force."""
    assert FORMULA <= deviation_of_force(0.3) < 1.01 * FORMULA < 0.11 * STATED


def test_what_is_moved_at_the_tip_is_known_all_the_same():
    assert deviation_of_force(1e-4, log=False) < 0.1 * STATED


@pytest.mark.parametrize(
    ("seen_um", "answer"),
    [
        ((117, 121, 113, 119, 60, 116), True),
        ((379, 243, 134, 115, -275), False),  # rings, and is weighed where it is least
        ((117, -20, 121, 3, -1), False),
        ((9, 1, 4, 12, 7), True),  # noise says as much of it
    ],
)
def test_rows_follow_what_acts_while_they_are_read(seen_um, answer):
    shift = 1e-3 * np.median(seen_um)
    n = len(seen_um)
    channels = np.zeros((9, n + 40, 1))
    channels[2, 20 : 20 + n] = 1.0
    rest = np.zeros((n + 40, 9))
    rest[20 : 20 + n, 2] = 1e-3 * np.array(seen_um) - shift
    problem = SimpleNamespace(
        bench=SimpleNamespace(runs=[None], read=lambda k, causes: None, difference=lambda k, reading: rest),
        columns=SimpleNamespace(blocks=(ByChannel.of(channels),)), member_columns=list, causes=lambda *a: [],
        floor=SimpleNamespace(axis_mm=0.003),
    )  # fmt: skip
    assert followed(problem, Fitted(members=(0,), theta=np.array([shift]), log_evidence=0.0, grams=()), 0) is answer
