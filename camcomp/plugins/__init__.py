"""Stable names for users' plug-ins to import, and the contracts of the plug-ins.

One file per shelf states the contract of its plug-ins as a protocol, and checks a user's plug-in when it is loaded.
"""

from camcomp.gcode.dialect import Dialect
from camcomp.model.config.base import Positive, Spec
from camcomp.model.cutting.cut import Cut
from camcomp.model.effect import Axes, Load, Motion, Parameter
from camcomp.plugins.dialects import DialectPlugin
from camcomp.plugins.effects import EffectHooks, EffectPlugin
from camcomp.plugins.forces import ForcePlugin
from camcomp.plugins.robots import RobotPlugin

__all__ = [
    "Axes",
    "Cut",
    "Dialect",
    "DialectPlugin",
    "EffectHooks",
    "EffectPlugin",
    "ForcePlugin",
    "Load",
    "Motion",
    "Parameter",
    "Positive",
    "RobotPlugin",
    "Spec",
]
