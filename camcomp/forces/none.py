"""No cutting force: the machine deflects under gravity and its own errors only. The smallest force model."""

import numpy as np

from camcomp.ground.datatypes import Floats
from camcomp.model.config.base import Spec
from camcomp.model.cutting.cut import Cut

SOURCES = "A definition: no force."

STEADY = True  # the force depends on the cut alone, not on the way to it


class Params(Spec):
    """No keys."""


def force(cut: Cut, params: Params) -> Floats:
    """Zero (n, 3) N."""
    return np.zeros((len(cut), 3))
