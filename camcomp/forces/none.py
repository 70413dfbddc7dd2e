"""No cutting force: the machine bends under gravity and its own errors only. The smallest force model."""

import numpy as np

from camcomp.cutting.cut import Cut
from camcomp.datatypes import Floats
from camcomp.specbase import Spec

SOURCES = "A definition: no force."


class Params(Spec):
    """No keys."""


def force(cut: Cut, params: Params) -> Floats:
    """Zero (n, 3) N."""
    return np.zeros((len(cut), 3))
