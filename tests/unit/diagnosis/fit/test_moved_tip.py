"""How far a change of the channels moves the tip: what counts as the size of a cause."""

from types import SimpleNamespace

import numpy as np

from camcomp.diagnosis.fit.columns import moved_tip

ALONG, ACROSS = np.array([0.004, 0.0, 0.0]), np.array([0.0, 0.003, 0.001])


def moved(turn):
    changes = np.stack([np.tile(each, (5, 1)) for each in (ALONG, ACROSS, ALONG + ACROSS)], axis=2)
    run = SimpleNamespace(turn=turn, by="tip", measured=SimpleNamespace(has=lambda _: False))
    return moved_tip(SimpleNamespace(runs=[run]), 0, changes)[0].T


def test_where_the_tip_is_the_motion_only_what_lies_across_the_path_is_an_error():
    assert np.array_equal(moved(np.tile(np.eye(3), (5, 1, 1))), [0.0 * ALONG, ACROSS, ACROSS])


def test_elsewhere_what_lies_along_it_is_one_too():
    assert np.array_equal(moved(None), [ALONG, ACROSS, ALONG + ACROSS])
