"""Lengths and products of many short vectors, and distinct values."""

from typing import Any

import numpy as np

from camcomp.ground.datatypes import Floats


def distinct(values: np.ndarray) -> list[Any]:
    """The different values (n,), ascending; unlike numpy's unique without the import of masked arrays."""
    return sorted(set(values.tolist()))


def sizes(vectors: Floats) -> Floats:
    """Euclidean length (n,) of vectors (n, c); for few columns faster than numpy's norm."""
    total = vectors[:, 0] * vectors[:, 0]
    for k in range(1, vectors.shape[1]):
        total += vectors[:, k] * vectors[:, k]
    return np.sqrt(total)


def cross_with(axis: Floats) -> Floats:
    """Matrix (3, 3) that turns rows v (n, 3) into their cross products with an axis (3,): v @ matrix = v x axis."""
    x, y, z = axis
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
