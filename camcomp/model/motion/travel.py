"""Points in the order of travel: the motion of the actuators that commands along them ask for, and commands ahead of control loops.

What the encoders have to reach is found without loops, and led through their inverse. In steps of the residual it would take many,
because a loop moves a point by what is commanded at those before it.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from camcomp.ground.datatypes import Bools, Floats
from camcomp.ground.records import dataclass, replace
from camcomp.model import signal_path
from camcomp.model.effect import Cause, Motion
from camcomp.model.hysteresis import REST_S, direction
from camcomp.model.job import Job
from camcomp.model.law.covariates import loads_along
from camcomp.model.statics.solve import inverse

WORDS = 3  # actuators that X, Y, Z can move one by one
STILL_MM = 1e-10  # residual at which a point is left alone while others go on
MAX_STEPS = 20


@dataclass(frozen=True, eq=False, kw_only=True)
class Travel:
    """n points in the order of travel: cutting force (n, 3) N in the machine frame, time, minutes of cutting.

    stop: the controller stops there. around (3, n, 3): programmed tips, program frame, AROUND_S before, at and after the
    nearest instant on the same smooth part of the path; None where time is unknown. rotation (n, 3, 3): commanded
    orientation of the platform, machine frame; None: the one that the machine holds.
    """

    force: Floats
    time: Floats  # (n,) s
    cut_min: Floats  # (n,) minutes
    stop: Bools
    around: Floats | None = None
    rotation: Floats | None = None

    def take(self, rows: np.ndarray) -> Travel:
        """Some of the points; rows have to be ascending."""
        around = None if self.around is None else self.around[:, rows]
        rotation = None if self.rotation is None else self.rotation[rows]
        return Travel(
            force=self.force[rows], time=self.time[rows], cut_min=self.cut_min[rows], stop=self.stop[rows],
            around=around, rotation=rotation,
        )  # fmt: skip

    @property
    def rested(self) -> Floats:
        """Times (n,) s with a pause of REST_S before every stop, after which a servo has settled."""
        return self.time + REST_S * np.cumsum(self.stop)


def set_points(job: Job, told: Floats, force: Floats, rotation: Floats | None) -> Floats:
    """Set-points (n, m) of commanded tips (n, 3), machine frame."""
    answers = job.real_machine.answers
    if answers is not None and rotation is None:
        return answers.set_points(told, force)  # type: ignore[no-any-return]
    return inverse(job.real_machine, told, rotation)


def set_point_rates(job: Job, tip: Floats, travel: Travel) -> Floats:
    """Derivatives (n, m, 3) of the set-points by the tip, program frame, along the axes of the machine."""
    h = 1e-3
    sides = (tip + h * axis for axis in np.eye(3)), (tip - h * axis for axis in np.eye(3))
    ahead, behind = ([set_points(job, each, travel.force, travel.rotation) for each in side] for side in sides)
    rates = [(a - b) / (2.0 * h) for a, b in zip(ahead, behind, strict=True)]
    return np.stack(rates, axis=2)


def tips_per_set_point(rates: Floats) -> Floats:
    """Pseudo-inverses (n, 3, m) of derivatives (n, m, 3) of set-points by the tip."""
    inverse_of = np.linalg.inv if rates.shape[1] == WORDS else np.linalg.pinv
    return np.asarray(inverse_of(rates), np.float64)


def motion_of(job: Job, setpoint: Floats, travel: Travel) -> Motion:
    """Motion for the hooks, with the encoders behind the servos."""
    stiffness = signal_path.springs(job.real_machine.robot)
    zero = np.zeros_like(setpoint)
    warm = job.config.process.temperature_C
    heat = None if warm is None else np.full(len(setpoint), warm)
    motion = Motion(
        time=travel.rested, common=travel.time, cut_min=travel.cut_min, temperature=heat, encoder=setpoint,
        speed=zero, direction=zero, home=job.real_machine.home, stiffness=stiffness, names=job.real_machine.actuators,
        stated_loads=partial(loads_along, job.real_machine.robot),
    )  # fmt: skip
    encoder = signal_path.controlled(job.causes, job.real_machine.actuators, motion)
    dt = np.diff(travel.rested, prepend=travel.time[:1] - 1.0)
    step = np.diff(encoder, axis=0, prepend=encoder[:1])
    speed = np.divide(step, dt[:, None], out=np.zeros_like(step), where=dt[:, None] > 0.0)
    return replace(motion, encoder=encoder, speed=speed, direction=direction(encoder))


def without_inverted_loops(job: Job, *, words: bool) -> tuple[list[Cause], Job]:
    """Control loops whose inverse leads the commands, and the job without them.

    words: by X, Y, Z, which cannot lead some of more than three actuators, but all alike.
    """
    alone = not words or len(job.real_machine.actuators) <= WORDS
    led = [signal_path.has_inverse(each) and (alone or each.target is None) for each in job.causes]
    loops = [each for each, leads in zip(job.causes, led, strict=True) if leads]
    return loops, job.with_causes(each for each, leads in zip(job.causes, led, strict=True) if not leads)


def lead(job: Job, loops: Sequence[Cause], rho: Floats, travel: Travel) -> Floats:
    """Set-points (n, m) from which control loops lead to the encoders that a job without them has at set-points rho (n, m)."""
    motion = motion_of(job, rho, travel)
    ahead = signal_path.set_points_for(loops, job.real_machine.actuators, motion)
    return rho + (ahead - motion.encoder)


def ahead_of_loops(job: Job, loops: Sequence[Cause], tips: Floats, travel: Travel, solved: Bools) -> Floats:
    """Commanded tips (n, 3), program frame, for a machine with control loops, from those for the job without them.

    solved (n,): the others stay.
    """
    if not loops:
        return tips
    rows = np.flatnonzero(solved)
    travel, out = travel.take(rows), tips.copy()
    told = job.frame.to_machine(tips[rows])
    rho = set_points(job, told, travel.force, travel.rotation)
    ways = tips_per_set_point(set_point_rates(job, told, travel))
    wanted = lead(job, loops, rho, travel)
    for _ in range(MAX_STEPS):
        step = np.einsum("nkm,nm->nk", ways, wanted - rho)
        told = told + step
        if not np.abs(step).max(initial=0.0) > STILL_MM:
            break
        rho = set_points(job, told, travel.force, travel.rotation)
    out[rows] = job.frame.to_program(told)
    return out
