"""Small machines and a movement of them, on which the hooks of a user's effect are tried when it is loaded."""

from typing import Any

import numpy as np

from camcomp.model.axes import axes_of
from camcomp.model.effect import Load, Motion
from camcomp.model.motion.twin import Reading
from camcomp.model.statics.description import Actuator, Chain, Link, Parallelogram, Passive, Robot, Transform
from camcomp.model.statics.masses import MassLoads

_ROWS = 41


def legs() -> Robot:
    """Three slides x, y, z that move a platform by parallelograms."""
    x, y, z = np.eye(3)
    behind = (
        Link(1e4 * np.eye(6)),
        Passive(True, z),
        Parallelogram(arm=310.0 * x, hinge=y, crossbar=z, width=80.0, bar_stiffness=1e4 * np.eye(6)),
        Passive(True, z),
    )
    chains = [
        Chain(
            name,
            (Actuator(name=name, revolute=False, axis=x, stiffness=1e4, home=-300.0), *behind),
            np.roll(np.eye(3), k, axis=0),
        )
        for k, name in enumerate("xyz")
    ]
    return Robot(name="three legs", chains=tuple(chains), tool=np.array([0.0, 0.0, -100.0]))


def arm() -> Robot:
    """Six hinges a1 to a6, each with an elastic link behind it."""
    elements: list[Any] = []
    for k in range(6):
        elements += [
            Actuator(name=f"a{k + 1}", revolute=True, axis=np.eye(3)[2 - k % 2], stiffness=1e9),
            Transform(np.array([100.0, 0.0, 50.0])),
            Link(1e6 * np.eye(6)),
        ]
    return Robot(name="six hinges", chains=(Chain("arm", tuple(elements)),), tool=np.array([0.0, 0.0, -100.0]))


def inputs(robot: Robot, *, whole: bool, named: str | None = None) -> dict[str, tuple[Any, ...]]:
    """Arguments of every hook except the parameters.

    whole: the target is the machine, else its first actuator; named: target of an effect with names of its own.
    """
    m = len(robot.actuators)
    time = np.linspace(0.0, 2.0, _ROWS)
    encoder = -200.0 + 20.0 * np.sin(np.outer(3.0 * time, 1.0 + 0.1 * np.arange(m)))
    speed = np.gradient(encoder, time, axis=0)
    home, stiffness = np.full(m, -300.0), np.full(m, 1e4)
    masses = MassLoads(0.5 * encoder, np.tile([30.0, -20.0, -900.0, 4e5, 6e5, 1e4], (_ROWS, 1)))
    motion = Motion(
        time=time, common=100.0 + time, cut_min=time / 60.0, temperature=22.0 + time, encoder=encoder, speed=speed,
        direction=np.sign(speed), home=home, stiffness=stiffness, masses=lambda: masses,
    )  # fmt: skip
    load = Load(np.tile([200.0, -10.0, -25.0], (_ROWS, 1)), np.zeros((_ROWS, 6)))
    which = np.ones(m) if whole else np.eye(m)[0]
    tip = 20.0 * np.column_stack((np.sin(time), np.cos(time), time))
    still = np.zeros_like(encoder)
    for each in (time, encoder, load.force, load.wrench, tip, still):
        each.flags.writeable = False
    names = tuple(each.name for each in robot.actuators)
    return {
        "on_servo": (encoder, motion, which),
        "invert_servo": (encoder, motion, which),
        "on_drive": (still, motion, which),
        "on_drive_force": (still, motion, which),
        "on_robot": (robot, names if whole else names[:1]),
        "on_links": (still, motion, which),
        "on_load": (load, motion),
        "on_guideway": (tip, axes_of(robot, motion, tip, np.zeros(3)), named),
        "on_pose": (tip, load, motion),
        "on_workpiece": (tip,),
        "on_place": (tip, load, motion),
        "on_clock": (time,),
        "on_reading": (Reading(tip, encoder, still, load.force, motion), motion),
    }
