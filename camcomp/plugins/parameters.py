"""The class Params of a robot or a force model: its keys in YAML."""

import warnings
from typing import Any

from camcomp.model.config.base import Spec
from camcomp.plugins.contract import described, refusal


def check_params(who: str, params: Any, taken: set[str]) -> None:
    """Check that Params is a Spec with valid YAML keys; `taken`: keys with another meaning there.

    Raises ConfigError CC280.
    """
    if not (isinstance(params, type) and issubclass(params, Spec)):
        raise refusal(who, f"Params is {described(params)}, not a class made from camcomp.plugins.Spec")
    if both := taken.intersection(params.yaml_keys()):
        raise refusal(who, f"Params has the key '{min(both)}', which means something else beside it")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            params.model_json_schema(by_alias=True)
    except Exception as error:
        raise refusal(who, f"Params has no JSON schema: {error}") from error
