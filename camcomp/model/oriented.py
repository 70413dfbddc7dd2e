"""Orientation of the platform commanded by words of orientation in a program.

With D (3, 3) of the words, in program axes, F the program frame in the machine frame and H the orientation that the machine
holds without words, the platform is turned to F D F^T H.
"""

from __future__ import annotations

import numpy as np

from camcomp.gcode.program import Program
from camcomp.ground.datatypes import Floats
from camcomp.ground.errors import ProgramError
from camcomp.ground.orientation import UPRIGHT, rotations_of, words_of
from camcomp.model.job import Job


def refuse_orientation(program: Program, what: str) -> None:
    """Raise ProgramError CC115 for a program that turns the tool, which `what` does not support."""
    turn = program.path.orientation
    if turn is None:
        return
    turned = np.abs(turn.end - turn.start).max(axis=1) + np.abs(turn.end - np.array(UPRIGHT[turn.form])).max(axis=1)
    lines = program.path.line[turned > 0.0]
    if len(lines):
        at = program.text.place(int(lines[0]) - 1)
        raise ProgramError(
            "CC115",
            f"{what} does not follow words of orientation",
            at=at,
            hint="compensate, verify, simulate of a log and diagnose do",
        )


def platform_rotations(job: Job, form: str, words: Floats) -> Floats:
    """Orientations (k, 3, 3) of the platform, machine frame, for words (k, 3)."""
    F = job.frame.rotation
    out: Floats = F @ rotations_of(form, words) @ F.T @ job.machine.nominal.held_rotation
    return out


def platform_words(job: Job, form: str, rotation: Floats, near: Floats) -> Floats:
    """Words (k, 3) of orientations (k, 3, 3) of the platform, on the branch nearest to words near (k, 3)."""
    F = job.frame.rotation
    return words_of(form, F.T @ (rotation @ job.machine.nominal.held_rotation.T) @ F, near)


def tilts(first: Floats, second: Floats) -> Floats:
    """Angles (k,) rad between orientations (k, 3, 3)."""
    R = first @ second.transpose(0, 2, 1)
    skew = np.stack((R[:, 2, 1] - R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0], R[:, 1, 0] - R[:, 0, 1]), axis=1)
    out: Floats = np.arctan2(0.5 * np.linalg.norm(skew, axis=1), 0.5 * (np.trace(R, axis1=1, axis2=2) - 1.0))
    return out
