"""Shapes that show only where an effect is as large as it is: how a loop rings shows when it rings.

At nominal all its dampings do the same, its size comes out too small, and far from the right values no slope leads to them.
So the scanned values are tried at some sizes, through the twin. Shapes of drives are scanned before (`grid_parameters`).
"""

from collections.abc import Callable, Sequence
from itertools import product

import numpy as np

from camcomp.ground.datatypes import Bools, Floats
from camcomp.ground.errors import PhysicsError
from camcomp.model.effect import Parameter

LARGER = (1.0, 1.4, 2.0, 2.8, 4.0, 5.6, 8.0)  # than a straight model says: sizes that are tried
FOLLOWED = 6  # further passes, in which size and shape settle together


def loudest(
    asked: Sequence[tuple[int, Parameter, Bools]],
    evidence: Callable[[Floats, dict[int, dict[str, float]]], float],
    theta: Floats,
    shapes: dict[int, dict[str, float]],
) -> Floats:
    """Takes the shapes asked for to the scanned values of most evidence, and returns theta (d,) with the sizes that go with them.

    asked: candidate, shape, and which of theta (d,) are the candidate's sizes.
    """
    for i, p, own in asked:
        tried: list[tuple[float, float, float]] = []
        for value, larger in product(p.scan, LARGER):
            there = {**shapes, i: {**shapes[i], p.name: value}}
            try:
                tried.append((evidence(np.where(own, larger * theta, theta), there), value, larger))
            except PhysicsError:
                continue
        if tried:
            _, shapes[i][p.name], larger = max(tried)
            theta = np.where(own, larger * theta, theta)
    return theta
