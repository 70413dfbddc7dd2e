"""What a user's plug-in may import, and nothing else: names that stay when the rooms behind them move."""

from camcomp.model.config.base import Positive, Spec
from camcomp.model.cutting.cut import Cut
from camcomp.model.effect import Load, Motion, Parameter

__all__ = ["Cut", "Load", "Motion", "Parameter", "Positive", "Spec"]
