"""What a user's plug-in may import, and nothing else: names that stay when the rooms behind them move.

One file per shelf says what its plug-ins have to be, as a protocol, and holds a user's own against it when it is loaded.
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
