"""The five trajectories of the tool tip: seed Fig. 4."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from camcomp.ground.datatypes import Floats
from camcomp.model.job import Job
from camcomp.model.statics.target import settle

if TYPE_CHECKING:
    from camcomp.compensation.program.compensate import Compensated


def trajectories(result: Compensated, job: Job) -> dict[str, Floats]:
    """Paths of the tip (N, 3) mm, program frame, by name: as programmed, as the original program leads it, as commanded.

    The original program on an imperfect machine without load, on a perfect one under the cutting force, and both.
    """
    target = job.frame.to_machine(result.rows.target)
    force = job.frame.vectors(result.rows.force)
    rotation = None if result.orienting is None else result.orienting.platform(result.programmed_words)
    alone, _ = settle(job.real_machine, target, np.zeros_like(force), rotation=rotation)
    loaded, _ = settle(job.perfect_machine, target, force, rotation=rotation)
    return {
        "target": result.rows.target, "chain_error": job.frame.to_program(alone), "force": job.frame.to_program(loaded),
        "both": result.uncorrected, "adjusted": result.written.end,
    }  # fmt: skip
