"""Whether a program keeps an arm on one branch of its inverse kinematics, away from singular configurations.

The branch is fixed by the start pose: every point is reached from there by walking in short steps. Here it is proved that
no step of the program changes it.
"""

from __future__ import annotations

import numpy as np

from camcomp.gcode.program import Program
from camcomp.ground.datatypes import Floats, Ints
from camcomp.ground.errors import PhysicsError, raise_all
from camcomp.ground.source_lines import named_lines
from camcomp.model.job import Job
from camcomp.model.statics.arm import NEAR_SINGULAR, Arm, arm_of, dexterity, follow

SINGULAR = 1e-4  # dexterity: drives turn 10 000 times as far as the tip needs
LARGE_TURN = 0.3  # rad between two end points: worth a closer look


def check_posture(program: Program, job: Job, line: Ints, tip: Floats, rho: Floats) -> list[str]:
    """Warnings for the source lines (N,) that pass near singular configurations.

    tip (N, 3) mm, machine frame, rho (N, m) as the control computes them. Raises PhysicsError CC303 for lines that go
    through one, CC305 where the joints would change to another branch. Machines that are no arms pass.
    """
    arm = arm_of(job.machine.nominal)
    if arm is None or not len(tip):
        return []
    room = dexterity(arm, rho)
    _refuse(program, "CC303", "the arm is singular", np.unique(line[room < SINGULAR]))
    if program.path.orientation is None:
        _refuse(program, "CC305", "the joints change to another branch", _flips(job, arm, line, tip, rho))
    near = np.unique(line[room < NEAR_SINGULAR])
    if not len(near):
        return []
    worst = int(np.argmin(room))
    text = f"near a singular configuration at {named_lines(near)}: nearest at line {line[worst]}, "
    return [text + f"dexterity {room[worst]:.4f}; drives move fast there, and their errors grow"]


def _flips(job: Job, arm: Arm, line: Ints, tip: Floats, rho: Floats) -> Ints:
    """Source lines at whose end the joints are not where a straight way from the end point before leads them."""
    far = np.flatnonzero(np.abs(np.diff(rho, axis=0)).max(axis=1) > LARGE_TURN) + 1
    held, tool = job.machine.nominal.held_rotation, job.machine.nominal.tool
    found = []
    for i in far:
        q = follow(arm, rho[i - 1], held, tip[i - 1] - held @ tool, tip[i] - held @ tool)
        if q is not None and np.abs(q - rho[i]).max() > 0.1 * LARGE_TURN:
            found.append(line[i])
    return np.unique(np.array(found, np.int64))


def _refuse(program: Program, rule: str, text: str, lines: Ints) -> None:
    errors = [PhysicsError(rule, f"{text} on this line", at=program.text.place(int(n) - 1, 0)) for n in lines[:20]]
    raise_all(errors)
