"""Lengths and products of many short vectors, and distinct values."""

from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from camcomp.ground.datatypes import Bools, Floats, Ints

Kind = TypeVar("Kind", bound=np.generic)


def distinct(values: np.ndarray) -> list[Any]:
    """The different values (n,), ascending; unlike numpy's unique without the import of masked arrays."""
    changed = values[1:] != values[:-1]  # most values are those before them
    return sorted({*values[:1].tolist(), *values[1:][changed].tolist()})


def chosen(values: NDArray[Kind], on: Bools) -> NDArray[Kind]:
    """Rows of values (n, ...) that are on (n,): a view where they follow each other, the array itself where all are on."""
    if on.all():
        return values
    first, last = int(on.argmax()), len(on) - int(on[::-1].argmax())
    return values[first:last] if on[first:last].all() else values.compress(on, axis=0)


def sizes(vectors: Floats) -> Floats:
    """Euclidean length (n,) of vectors (n, c); for few columns faster than numpy's norm."""
    total = vectors[:, 0] * vectors[:, 0]
    for k in range(1, vectors.shape[1]):
        total += vectors[:, k] * vectors[:, k]
    return np.sqrt(total)


def largest(vectors: Floats) -> Floats:
    """Largest size (n,) of a component of vectors (n, c); for few columns faster than numpy's maximum along rows."""
    out: Floats = np.abs(vectors[:, 0])
    for k in range(1, vectors.shape[1]):
        out = np.maximum(out, np.abs(vectors[:, k]))
    return out


def largest_of_groups(values: Floats, group: Ints, groups: int) -> Floats:
    """The largest of values (k,) >= 0 without NaN in each of some groups, group (k,) of every value; 0 without values."""
    out = np.zeros(groups)
    np.fmax.at(out, group, values)
    return out


def shifted(points: Floats, by: Floats) -> Floats:
    """Points (n, c) plus a vector (c,); for few columns faster than numpy's sum."""
    return shift(np.array(points, float), by)


def shift(points: Floats, by: Floats) -> Floats:
    """`shifted` in the place of the points; returns them."""
    for k in range(points.shape[-1]):
        points[..., k] += by[k]
    return points


def cross_with(axis: Floats) -> Floats:
    """Matrix (3, 3) that turns rows v (n, 3) into their cross products with an axis (3,): v @ matrix = v x axis."""
    x, y, z = axis
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
