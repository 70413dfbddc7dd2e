"""Contract of force models, checked when a user's model is loaded."""

from types import ModuleType
from typing import Any, Protocol

import numpy as np

from camcomp.ground.datatypes import Floats
from camcomp.model.config.base import Spec
from camcomp.model.cutting.cut import Cut
from camcomp.plugins.contract import (
    check_functions,
    check_module,
    check_names,
    described,
    guarded,
    refusal,
    with_functions,
)
from camcomp.plugins.parameters import check_params


class ForcePlugin(Protocol):
    """Cutting force on the tool at the points of a path.

    May also have PLUNGES (True: it acts in plunges, too) and check(params), which raises CamcompError for missing or invalid
    files before a program is read.
    """

    Params: type[Spec]  # YAML keys in addition to `model:`
    SOURCES: str  # references of the law and its numbers

    def force(self, cut: Cut, params: Any) -> Floats:
        """(Fr, Ft, Fz) (n, 3) N on the tool: right of the feed, along it, along the tool axis away from the workpiece."""


def checked(name: str, found: Any, who: str) -> ModuleType:
    """The force model behind an entry point, its function guarded. Raises ConfigError CC280."""
    del name
    module = check_module(who, found)
    check_names(who, module, {"Params": type, "SOURCES": str})
    check_params(who, module.Params, {"model"})
    if not check_functions(who, module, ForcePlugin, ("check",)):
        raise refusal(who, "there is no function force(cut, params)")
    if not isinstance(getattr(module, "PLUNGES", False), bool):
        raise refusal(who, f"PLUNGES is {described(module.PLUNGES)}, not True or False")
    return with_functions(module, {"force": guarded(who, "force", module.force, _wrong)})


def _wrong(result: Any, cut: Cut, _params: Any) -> str:
    """Error text for an invalid result; empty: valid."""
    if not isinstance(result, np.ndarray) or result.shape != (len(cut), 3) or result.dtype.kind not in "fiu":
        return f"{described(result)}, not an array {(len(cut), 3)} of floats"
    bad = ~np.isfinite(result).all(axis=1)
    if bad.any():
        k = int(np.argmax(bad))
        return f"{result[k].tolist()} N at line {cut.line[k]} of the program"
    return ""
