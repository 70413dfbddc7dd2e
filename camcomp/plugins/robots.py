"""Contract of robots, checked when a user's robot is loaded."""

from types import ModuleType
from typing import Any, Protocol

from camcomp.model.config.base import Spec
from camcomp.model.config.load import ROBOT_KEYS
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


class RobotPlugin(Protocol):
    """A family of machines: its parameters, and the chains of one machine in the keys of a machine file."""

    Params: type[Spec]  # YAML keys in addition to `type:`

    def chains(self, params: Any) -> dict[str, Any]:
        """The chains by name, each a mapping as below `chains:` in a machine file."""


def checked(name: str, found: Any, who: str) -> ModuleType:
    """The robot behind an entry point, its function guarded. Raises ConfigError CC280."""
    del name
    module = check_module(who, found)
    check_names(who, module, {"Params": type})
    check_params(who, module.Params, {"type", "chains", *ROBOT_KEYS} - {"source"})
    if not check_functions(who, module, RobotPlugin):
        raise refusal(who, "there is no function chains(params)")
    return with_functions(module, {"chains": guarded(who, "chains", module.chains, _wrong)})


def _wrong(result: Any, _params: Any) -> str:
    return "" if isinstance(result, dict) else f"{described(result)}, not a dict of chains"
