"""Labels of clampings and clocks: their differences are nuisances, their common part is a cause.

Runs without a label share one clamping and one clock, and labels differ from it. Where every run has a label there is
nothing to differ from: then labels scatter about what they have in common, by as much as they are seen to. What clocks differ
by is found before anything is asked about causes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.special import ndtr, stdtrit

from camcomp.diagnosis.statistics.noise_model import weighted_median
from camcomp.ground import shelf
from camcomp.ground.datatypes import Floats
from camcomp.model.effect import Cause

if TYPE_CHECKING:
    from camcomp.diagnosis.fit.bench import Run
    from camcomp.model.motion.twin import Twin

PASSES = 5
STEP_S = 1e-4  # in which a tip moves in one direction
CLOCK_JITTER_S = 1e-5  # of a clock, and of its second
Label = str | int | None
EFFECT_OF = {"clock": "time_sync", "clamping": "workpiece_frame"}  # what a label may differ by


def apart(labels: Sequence[Label]) -> list[str | int]:
    """The labels that have an offset of their own: all but the one that runs without a label share; none if there is but one."""
    every = list(dict.fromkeys(labels))
    return [each for each in every if each is not None] if len(every) > 1 else []


def scatter(offsets: Floats) -> float:
    """Upper bound of the standard deviation of offsets (labels,) about their mean, by Student's t for few labels."""
    few = -float(stdtrit(len(offsets) - 1, ndtr(-1.0)))
    return float(np.std(offsets, ddof=1)) * few


def label_name(label: str, value: str | int, parameter: str) -> str:
    """Name of the column by which a label's parameter differs."""
    return f"{label} {value}.{parameter}"


def with_clocks(twin: Twin, runs: Sequence[Run]) -> list[Run]:
    """The runs with what their labelled clocks differ by taken up: milliseconds are too much for columns that are straight."""
    seen = [
        k for k, run in enumerate(runs) if run.measured.has("tip") and not run.run_path.led and run.run_path.ordered
    ]
    labels = {k: runs[k].clock for k in seen}
    found = {
        each: _offset(twin, [runs[k] for k in seen if labels[k] == each]) for each in dict.fromkeys(labels.values())
    }
    common = found[None] if None in found else float(np.mean(list(found.values()))) if found else 0.0
    out = list(runs)
    for k in seen:
        late = found[labels[k]]
        out[k] = replace(runs[k], run_path=replace(runs[k].run_path, clock_s=late - common, between_s=abs(late)))
    return out


def _offset(twin: Twin, runs: Sequence[Run]) -> float:
    """Clock offset, s, of runs of one label: the weighted median over rows, which neither outliers nor other errors lead far."""
    clock, offset = shelf.load("effects", "time_sync"), 0.0
    solved = [twin.sense(run.run_path)[1] for run in runs]
    for _ in range(PASSES):
        late, speed = [], []
        for run, known in zip(runs, solved, strict=True):
            now, later = (
                twin.sense(run.run_path, [Cause("time_sync", clock, None, {"offset_s": offset + step})], solved=known)[
                    0
                ].tip
                for step in (STEP_S, -STEP_S)
            )
            velocity = (later - now) / (2.0 * STEP_S)
            v = np.linalg.norm(velocity, axis=1)
            ahead = np.sum((run.measured.tip - 0.5 * (now + later)) * velocity, axis=1)
            use = np.isfinite(ahead) & (v > 0.0)
            late.append(-ahead[use] / v[use] ** 2)
            speed.append(v[use])
        change = weighted_median(np.concatenate(late), np.concatenate(speed))
        offset += change
        if abs(change) < CLOCK_JITTER_S:
            break
    return offset
