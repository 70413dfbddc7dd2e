"""Axes X, Y, Z of a machine for hooks of guideways: position, direction of travel, and arm to the tip."""

from __future__ import annotations

import numpy as np

from camcomp.ground.datatypes import Floats
from camcomp.model.effect import Axes, Motion
from camcomp.model.statics.description import Actuator, Robot, Transform

_ALONG = 0.999  # cosine to an axis of the machine from which on a slide is that axis


def axes_of(robot: Robot, motion: Motion, tip: Floats, origin: Floats) -> Axes:
    """Axes for tips (n, 3), machine frame; origin (3,) of the program.

    A carriage carries the slides that follow it in the chain. With several chains, or without a slide along an axis, the
    axis is that of the tip's coordinate and carries the tool alone.
    """
    tool = robot.held_rotation @ robot.tool
    position = tip - tool
    direction = np.zeros_like(tip)
    arm = np.repeat(np.tile(tool, (3, 1))[None], len(tip), axis=0)
    slides = slides_of(robot)
    for at, (axis, actuator, sense) in enumerate(slides):
        direction[:, axis] = sense * motion.direction[:, actuator]
        for borne, _, _ in slides[at + 1 :]:
            arm[:, axis, borne] += position[:, borne]
    return Axes(tip - origin, position, direction, arm)


def slides_of(robot: Robot) -> list[tuple[int, int, float]]:
    """(axis, actuator, sense) of the slides along X, Y, Z from the base on; empty for machines with several chains."""
    if len(robot.chains) != 1:
        return []
    turned, actuator = np.asarray(robot.chains[0].frame), -1
    found: list[tuple[int, int, float]] = []
    for each in robot.chains[0].elements:
        if isinstance(each, Transform):
            turned = turned @ each.rotation
        if not isinstance(each, Actuator):
            continue
        actuator += 1
        along = turned @ each.axis
        axis = int(np.argmax(np.abs(along)))
        if each.revolute:
            return []
        if abs(along[axis]) > _ALONG:
            found.append((axis, actuator, float(np.sign(along[axis]))))
    return found
