"""Tip and orientation corrected together, for machines of six actuators whose programs say how the tool is turned.

The whole pose is solved first; its orientation becomes words, and the tip is solved anew for what these words say. So the
tip is as exact as without words, also where words say less than an orientation (A3, B3, C3 leave the turn about the tool).
"""

from __future__ import annotations

import numpy as np

from camcomp.compensation.program.division import Nodes
from camcomp.gcode.output import Part
from camcomp.gcode.program import Program
from camcomp.ground.datatypes import Bools, Floats, Ints, Path
from camcomp.ground.errors import ConfigError, ProgramError
from camcomp.ground.orientation import RPY, UPRIGHT, VECTOR, between
from camcomp.ground.records import dataclass, replace
from camcomp.ground.vectors import largest_of_groups, sizes
from camcomp.model.cutting.track import Track
from camcomp.model.job import Job
from camcomp.model.motion.response import aim_at, respond, without_drives
from camcomp.model.motion.travel import Travel
from camcomp.model.oriented import platform_rotations, platform_words, tilts
from camcomp.model.statics.rotation import exp_rotation
from camcomp.model.statics.target import Correction

TILT_RAD = 4e-6  # that straight lines of words may miss between two points: half of what a program may leave
EFFECT_PASSES = 6  # each leaves about a thousandth of what effects turn
MOST_TILT_RAD = 8e-6  # that a program may leave
DEGREES_PER_RAD = 180.0 / np.pi


@dataclass(frozen=True, eq=False)
class Orienting:
    """How a program states orientation, and on which machine."""

    job: Job
    form: str

    @classmethod
    def of(cls, program: Program, job: Job, corrected: Program | None = None) -> Orienting | None:
        """Orientation handling of a program; None if program, correction and config all lack orientations.

        Raises ConfigError CC205 and ProgramError CC115 where it cannot be followed or written.
        """
        stated, asked = program.path.orientation, job.config.control.orientation_words
        if stated is None and corrected is not None:
            stated, asked = corrected.path.orientation, None
        if stated is None and asked is None:
            return None
        if len(job.machine.actuators) != 6:
            raise ConfigError(
                "CC205",
                "orientation_words need a machine with six actuators",
                at=job.config.at("control", "orientation_words"),
            )
        if stated is None and program.dialect == "sinumerik":
            raise ProgramError("CC115", "A, B and C are no words of orientation on Sinumerik", at=program.text.place(0),
                               hint="post with TRAORI and A3= B3= C3=, or leave orientation_words out")  # fmt: skip
        return cls(job, RPY if stated is None else stated.form)

    def programmed(self, track: Track, piece: Ints, w: Floats) -> Floats:
        """Words (k, 3) of the program at fractions w (k,) of pieces (k,)."""
        return self.words(track.path, track.motion[piece], track.u(piece, w))

    def words(self, path: Path, motion: Ints, u: Floats) -> Floats:
        """Words (k, 3) of a path at fractions u (k,) of motions (k,)."""
        if path.orientation is None:
            return np.tile(UPRIGHT[self.form], (len(motion), 1))
        return path.orientation.words(motion, u)

    def platform(self, words: Floats) -> Floats:
        """Orientations (k, 3, 3) of the platform, machine frame."""
        return platform_rotations(self.job, self.form, words)

    def aim(self, target: Floats, travel: Travel, near: Floats) -> tuple[Correction, Floats]:
        """Commands for loaded tips at the targets (n, 3) in the orientations of the travel, and their words (n, 3)."""
        exact = without_drives(self.job, target, travel, pose=True)
        solved = exact.status == 0
        words = near.copy()
        words[solved] = platform_words(self.job, self.form, exact.rotation[solved], near[solved])
        found = aim_at(self.job, target, self.told(travel, words), "newton")
        for _ in range(EFFECT_PASSES if self.job.causes else 0):
            turned = self._held_back(target, travel, found, words)
            if turned is None:
                break
            words = turned
            found = aim_at(self.job, target, self.told(travel, words), "newton")
        return found, words

    def _held_back(self, target: Floats, travel: Travel, found: Correction, words: Floats) -> Floats | None:
        """Words (n, 3) that cancel the tilt by effects in drives and structure; None where the tilt is negligible."""
        told, requested = self.platform(words), self.requested(travel)
        _, state = respond(self.job.correctable, found.commanded, replace(travel, rotation=told), target)
        if not np.nan_to_num(self.tilt(told, state, requested)).max(initial=0.0) > 0.5 * TILT_RAD:
            return None
        on, loaded = _loaded(told, state)
        out = words.copy()
        out[on] = platform_words(self.job, self.form, requested[on] @ loaded.transpose(0, 2, 1) @ told[on], words[on])
        return out

    def told(self, travel: Travel, words: Floats) -> Travel:
        """The travel with the orientation that words (n, 3) say."""
        return replace(travel, rotation=self.platform(words))

    def requested(self, travel: Travel) -> Floats:
        """Orientations (n, 3, 3) of the platform that a travel asks for, machine frame."""
        held = np.broadcast_to(self.job.machine.nominal.held_rotation, (len(travel.force), 3, 3))
        return held if travel.rotation is None else travel.rotation

    def tilt(self, told: Floats, state: Correction, requested: Floats) -> Floats:
        """Angles (k,) rad of the loaded platform to the programmed orientations (k, 3, 3); NaN without a solution.

        Of the tool's axis alone where words say no more.
        """
        out = np.full(len(told), np.nan)
        on, loaded = _loaded(told, state)
        if self.form == VECTOR:
            one, other = loaded[:, :, 2], requested[on][:, :, 2]
            sine = sizes(np.cross(one, other))
            out[on] = np.arctan2(sine, np.einsum("ni,ni->n", one, other))
        else:
            out[on] = tilts(loaded, requested[on])
        return out

    def kept(self, track: Track, nodes: Nodes, words: Floats) -> Bools:
        """Pieces (p,) on which the correction turns the tool by less than TILT_RAD."""
        own = self.programmed(track, nodes.piece, nodes.w)
        turned = tilts(self.platform(words), self.platform(own))
        out: Bools = largest_of_groups(turned, nodes.piece, len(track.motion)) <= TILT_RAD
        return out

    def length(self, budget_mm: float) -> float:
        """Length, mm, of a unit of a word by which a miss of TILT_RAD weighs as much as one of the budget, mm."""
        return budget_mm / TILT_RAD / (1.0 if self.form == VECTOR else DEGREES_PER_RAD)

    def along(self, ends: Floats, before: Floats, row: Ints, fraction: Floats) -> Floats:
        """Words (k, 3) at fractions (k,) of the moves to words `ends` (N, 3), the first of which begins at `before` (3,)."""
        start = np.concatenate((before[None], ends[:-1]))[row]
        return between(self.form, start, ends[row], fraction)


def refuse_unfollowed(job: Job, method: str, part: Part | None) -> None:
    """Raises ConfigError where a program with orientation asks for more than is done with one."""
    if method != "newton" or part is not None:
        raise ConfigError(
            "CC205", f"the method {method} does not turn the tool", at=job.config.at("compensation"), hint="use newton"
        )
    if job.config.uncertain and job.config.compensation.policy != "full":
        raise ConfigError(
            "CC205",
            "a policy is not followed in programs with orientation",
            at=job.config.at("compensation", "policy"),
            hint="use full",
        )


def _loaded(told: Floats, state: Correction) -> tuple[Ints, Floats]:
    """Solved points (j,), and orientations (j, 3, 3) of the loaded platform there."""
    on = np.flatnonzero(state.status == 0)
    return on, np.array([exp_rotation(each) for each in state.tilt[on]]).reshape(-1, 3, 3) @ told[on]
