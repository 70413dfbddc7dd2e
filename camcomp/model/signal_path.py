"""The signal path: order of the hooks of effects between set-point and sensor, defined in this file only.

Callers of the model (the twin in time, the response along a program, poses of an arm, a stream of set-points) solve the
structure themselves and call these functions for the hooks. Each applies one stage, effects in the order given.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any

import numpy as np

from camcomp.ground.datatypes import Floats
from camcomp.ground.errors import PhysicsError
from camcomp.ground.records import replace
from camcomp.model.axes import axes_of
from camcomp.model.effect import Cause, Load, Motion, Parameter
from camcomp.model.statics.description import Robot

ORDER = (
    ("control", ("on_servo",)),
    ("drive", ("on_drive", "on_drive_force")),
    ("structure", ("on_robot",)),
    ("process", ("on_load",)),
    ("tool", ("on_links", "on_guideway", "on_pose")),
    ("workpiece", ("on_workpiece", "on_place")),
    ("sensor", ("on_clock", "on_reading")),
)
STAGES = tuple(stage for stage, _ in ORDER)
HOOKS = tuple(hook for _, hooks in ORDER for hook in hooks)
_AT = dict(ORDER)
INVERSE = "invert_servo"  # of on_servo, for effects that have one


def stages_of(effect: Any) -> set[str]:
    """The stages of the signal path at which an effect has hooks."""
    return {stage for stage, hooks in ORDER if any(hasattr(effect, hook) for hook in hooks)}


def fitted_parameters(effect: Any, hinge: bool) -> tuple[Parameter, ...]:
    """Parameters in which an effect is fitted on a hinge or a slide; none where it says nothing of such an actuator.

    Lengths of a slide's drive mean nothing to a hinge.
    """
    own, rotary = getattr(effect, "FITTED", effect.PARAMETERS), getattr(effect, "ROTARY", None)
    if not hinge:
        return () if own == rotary else tuple(own)
    if rotary is not None or getattr(effect, "SLIDES_ONLY", False):
        return tuple(rotary or ())
    return tuple(p for p in own if p.unit in ("1", "ppm") or "drive" not in stages_of(effect))


def pushes(effect: Any) -> bool:
    """Whether an effect is a force: at the tool, or beyond the load of the structure at a drive."""
    return hasattr(effect, "on_load") or hasattr(effect, "on_drive_force")


def acting(causes: Sequence[Cause], stage: str) -> list[Cause]:
    """The causes with a hook at a stage."""
    return [cause for cause in causes if any(hasattr(cause.effect, hook) for hook in _AT[stage])]


def has_inverse(cause: Cause) -> bool:
    """Whether a cause at the control states its inverse."""
    return cause.hook(INVERSE) is not None


def under_measured_force(causes: Sequence[Cause]) -> tuple[Cause, ...]:
    """Causes that act where the cutting force is measured: all except errors of the force model."""
    return tuple(cause for cause in causes if not getattr(cause.effect, "MODELLED_FORCE", False))


def momentary(causes: Sequence[Cause]) -> bool:
    """Whether drives have no memory: their state at an instant depends on that instant alone."""
    return all(getattr(cause.effect, "MOMENTARY", False) for cause in acting(causes, "drive"))


def has_memory(causes: Sequence[Cause]) -> bool:
    """Whether the response at a point may depend on the points before it: all but changes of robot and clamping, and momentary drives."""
    return not all(_acts_pointwise(cause.effect) for cause in causes)


def _acts_pointwise(effect: Any) -> bool:
    hooks = {hook for hook in HOOKS if hasattr(effect, hook)}
    still = {"on_robot", "on_workpiece"}  # which do not see the motion
    return bool(hooks) and hooks <= still | (set(_AT["drive"]) if getattr(effect, "MOMENTARY", False) else set())


def controlled(causes: Sequence[Cause], actuators: tuple[str, ...], motion: Motion) -> Floats:
    """Encoders (n, m) of a motion whose encoders are still the set-points.

    What deflects a loop, such as friction, acts on it as a change of its set-points does: the effects listed before it follow,
    except where no set-point makes them.
    """
    encoder, told = motion.encoder, motion
    loops: list[Cause] = []
    for hook, cause in _hooks(causes, "on_servo"):
        behind = hook(encoder, motion, cause.which(actuators), cause.values)
        law = cause.values.get("law")
        if law is not None and law.deflects:
            pushed = replace(told, encoder=told.encoder + behind - encoder)
            behind = encoder + controlled(loops, actuators, pushed) - controlled(loops, actuators, told)
            told = pushed
        elif not cause.uncorrectable:
            loops.append(cause)
        encoder = behind
    return encoder


def set_points_for(causes: Sequence[Cause], actuators: tuple[str, ...], motion: Motion) -> Floats:
    """Set-points (n, m) whose encoders are those of a motion, by the inverse of `controlled` for causes that state theirs."""
    position = motion.encoder
    for hook, cause in reversed(list(_hooks(causes, INVERSE))):
        position = hook(position, motion, cause.which(actuators), cause.values)
    return position


def on_top(causes: Sequence[Cause], stated: Sequence[Cause]) -> list[Cause]:
    """Stated causes, changed where one of `causes` is the same effect at the same target or at all, and the other causes."""
    out, new = [*stated], []
    for cause in causes:
        same = [i for i, own in enumerate(out) if own.name == cause.name and own.target in (cause.target, None)]
        if not same:
            new.append(cause)
        for i in same:
            records = {p.name: p for p in cause.effect.PARAMETERS}
            changed = {n: records[n].on_top(v, cause.values[n]) for n, v in out[i].values.items() if n in records}
            out[i] = replace(out[i], values={**cause.values, **changed})
    return [*out, *new]


def driven(causes: Sequence[Cause], actuators: tuple[str, ...], motion: Motion) -> tuple[Floats, Motion]:
    """Carriage minus encoder (n, m), and the motion with the nut behind screw and play, for effects of guides.

    Effects with a force of their own come last: guides hold back the carriage, behind the screw and its play.
    """
    error = np.zeros_like(motion.encoder)
    friction = friction_behind_play(causes, actuators)
    motion = motion if friction is None else replace(motion, friction=friction)
    drives = list(_hooks(causes, "on_drive"))
    for guide in (False, True):
        if guide and any(cause.hook("on_drive_force") is not None for cause in causes):
            motion = replace(motion, nut=motion.encoder + error)
        for hook, cause in drives:
            if (cause.hook("on_drive_force") is not None) == guide:
                error = hook(error, motion, cause.which(actuators), cause.values)
    return error, motion


def friction_behind_play(causes: Sequence[Cause], actuators: tuple[str, ...]) -> Floats | None:
    """Coulomb force (m,) of the guides behind the play of every drive, N or N mm; NaN where no cause states one, None where none do.

    What is within the tolerance of every healthy machine is not stated.
    """
    total = np.zeros(len(actuators))
    for cause in causes:
        for p in cause.effect.PARAMETERS:
            if p.name in getattr(cause.effect, "COULOMB", ()) and cause.values.get(p.name, 0.0) > p.tolerance:
                total += cause.values[p.name] * cause.which(actuators)
    return np.where(total > 0.0, total, np.nan) if total.any() else None


def drive_forces(causes: Sequence[Cause], actuators: tuple[str, ...], guided: Motion) -> Floats | None:
    """Force (n, m) N or N mm of the drives beyond the load of the structure; None if all effects lack one.

    guided: the motion from `driven`.
    """
    effort = None
    for hook, cause in _hooks(causes, "on_drive_force"):
        effort = np.zeros_like(guided.encoder) if effort is None else effort
        effort = hook(effort, guided, cause.which(actuators), cause.values)
    return effort


def edited(causes: Sequence[Cause], actuators: tuple[str, ...], robot: Robot) -> tuple[Robot, tuple[Cause, ...]]:
    """The machine changed by effects, and the causes that changed it."""
    by = []
    for hook, cause in _hooks(causes, "on_robot"):
        changed = hook(robot, cause.aimed(actuators), cause.values)
        if changed is not robot:
            by.append(cause)
        robot = changed
    return robot, tuple(by)


def springs(robot: Robot) -> Floats:
    """Stiffness (m,) of the drives, as a Motion states it; inf = rigid."""
    return np.array([np.inf if each.stiffness is None else each.stiffness for each in robot.actuators])


def loaded(causes: Sequence[Cause], motion: Motion, force: Floats) -> Load:
    """Load on the tool under a cutting force (n, 3), modelled or, where the motion says so, measured."""
    load = Load(force, np.zeros((len(force), 6)))
    for hook, cause in _hooks(under_measured_force(causes) if motion.measured_force else causes, "on_load"):
        load = hook(load, motion, cause.values)
    return load


def grown(causes: Sequence[Cause], actuators: tuple[str, ...], motion: Motion) -> Floats | None:
    """Growth (n, m) mm of the link behind every actuator; None without such an effect."""
    length = None
    for hook, cause in _hooks(causes, "on_links"):
        length = np.zeros_like(motion.encoder) if length is None else length
        length = hook(length, motion, cause.which(actuators), cause.values)
    return length


def led(causes: Sequence[Cause], tip: Floats, motion: Motion, robot: Robot, origin: Floats) -> Floats:
    """Tips (n, 3), machine frame, with the errors of guideways (straightness, squareness).

    origin (3,): of the program; all hooks see the axes of perfect guideways.
    """
    hooks = list(_hooks(causes, "on_guideway"))
    axes = axes_of(robot, motion, tip, origin) if hooks else None
    for hook, cause in hooks:
        tip = hook(tip, axes, cause.target, cause.values)
    return tip


def posed(causes: Sequence[Cause], tip: Floats, load: Load, motion: Motion) -> Floats:
    """Tips (n, 3), machine frame, behind the tool."""
    for hook, cause in _hooks(causes, "on_pose"):
        tip = hook(tip, load, motion, cause.values)
    return tip


def clamped(causes: Sequence[Cause], tip: Floats) -> Floats:
    """Tips (n, 3), program frame, relative to the clamped workpiece."""
    for hook, cause in _hooks(causes, "on_workpiece"):
        tip = hook(tip, cause.values)
    return tip


def placed(causes: Sequence[Cause], tip: Floats, load: Load, motion: Motion) -> Floats:
    """Tips (n, 3), program frame, with errors that depend on position, load and motion."""
    for hook, cause in _hooks(causes, "on_place"):
        tip = hook(tip, load, motion, cause.values)
    return tip


def clock(causes: Sequence[Cause], time: Floats) -> Floats:
    """True times (n,) s of tip rows with time stamps `time` (n,); `time` itself without such an effect."""
    for hook, cause in _hooks(causes, "on_clock"):
        time = hook(time, cause.values)
    return time


def read(causes: Sequence[Cause], reading: Any, motion: Motion) -> Any:
    """Readings with the effects of the sensors."""
    for hook, cause in _hooks(causes, "on_reading"):
        reading = hook(reading, motion, cause.values)
    return reading


def _hooks(causes: Sequence[Cause], name: str) -> Iterator[tuple[Callable[..., Any], Cause]]:
    for cause in causes:
        if (hook := cause.hook(name)) is not None:
            yield partial(_finite, hook, cause), cause


def _finite(hook: Callable[..., Any], cause: Cause, *given: Any) -> Any:
    """Result of a hook. Raises PhysicsError CC306 if it is not finite although all arguments are."""
    answer = hook(*given)
    if not all(map(_all_finite, _numbers(answer))) and all(
        _all_finite(each) for one in given for each in _numbers(one)
    ):
        raise PhysicsError("CC306", f"effect '{cause.name}' answers with what is not finite", at=cause.at)
    return answer


def _numbers(value: Any) -> tuple[Floats, ...]:
    """Arrays in an argument or a result of a hook, without the infinite stiffness of rigid drives."""
    if isinstance(value, Load):
        return value.force, value.wrench
    if isinstance(value, Motion):
        return value.time, value.encoder
    return (value,) if isinstance(value, np.ndarray) else ()


def _all_finite(values: Floats) -> bool:
    return bool(np.isfinite(values).all())
