"""Labels of clampings and clocks: their differences are nuisances, their common part is a cause.

Runs without a label share one clamping and one clock, and labels differ from it. Where every run has a label there is
nothing to differ from: then labels scatter about what they have in common, by as much as they are seen to.
"""

from collections.abc import Sequence

import numpy as np
from scipy.special import ndtr, stdtrit

from camcomp.ground.datatypes import Floats

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
