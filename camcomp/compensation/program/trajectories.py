"""Trajectories of the original program for one cause at a time: seed Fig. 4."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from camcomp.ground.datatypes import Floats
from camcomp.ground.records import dataclass
from camcomp.model.job import Job
from camcomp.model.statics.target import settle

if TYPE_CHECKING:
    from camcomp.compensation.program.compensate import Compensated


@dataclass(frozen=True, eq=False)
class Trajectories:
    """Where the original program takes the tip (N, 3) mm, program frame, for one cause at a time: seed Fig. 4."""

    chain_error: Floats  # imperfect chains, no load
    force: Floats  # perfect chains, cutting force


def trajectories(result: Compensated, job: Job) -> Trajectories:
    """The trajectories of the original program that a compensation does not need itself."""
    target = job.frame.to_machine(result.rows.target)
    force = job.frame.vectors(result.rows.force)
    rotation = None if result.orienting is None else result.orienting.platform(result.programmed_words)
    alone, _ = settle(job.real_machine, target, np.zeros_like(force), rotation=rotation)
    loaded, _ = settle(job.perfect_machine, target, force, rotation=rotation)
    return Trajectories(job.frame.to_program(alone), job.frame.to_program(loaded))
