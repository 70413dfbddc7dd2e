"""Texts of causes in the language of a workshop: effects, sizes with digits by their intervals, positions."""

from __future__ import annotations

import re
from functools import cache
from typing import Any

from camcomp.diagnosis.result.types import UNKNOWN, Driver, Estimate, FoundCause, LawTerm, NamedCause
from camcomp.diagnosis.statistics.probability import EVEN
from camcomp.ground import shelf
from camcomp.ground.errors import ConfigError
from camcomp.report.plot import brief, format_together

_SMALLER = {  # units of small values
    "mm": (1e3, "µm"), "rad": (1e3, "mrad"), "s": (1e3, "ms"), "mm/N": (1e3, "µm/N"), "rad/Nmm": (1e9, "µrad/Nm"),
}  # fmt: skip
_UNDETERMINED = " not determined"
_LONG_NUMBER = re.compile(r"\d+\.\d{3,}(?:e[+-]?\d+)?")
_COVARIATES = {
    "position": "where {0} stands",
    "velocity": "the speed of {0}",
    "acceleration": "the acceleration of {0}",
    "reversal": "the reversals of {0}",
    "direction": "the direction in which {0} moves",
    "force": "the force along {0}",
    "time": "time ({0})",
    "temperature": "the temperature",
}


@cache
def _effect(name: str) -> Any:
    try:
        return shelf.load("effects", name)
    except ConfigError:  # a law that has no file, or an effect of another installation
        return None


def plain(cause: NamedCause) -> str:
    """Name of the effect in a workshop."""
    usual = "none of the effects of the library" if cause.effect == UNKNOWN else cause.effect.replace("_", " ")
    return str(getattr(_effect(cause.effect), "PLAIN", usual))


def remedy(cause: NamedCause) -> str:
    """Remedy of an effect; may be empty."""
    return str(getattr(_effect(cause.effect), "REMEDY", ""))


def cell(value: float) -> tuple[float, str]:
    """A number of a table: value to sort by, and its text."""
    return float(value), brief(value)


def percent(share: float) -> str:
    """A share in percent, at least the smallest printed one."""
    return "less than 1 %" if 0.0 < share < 0.01 else f"{100.0 * share:.0f} %"


def sizes(cause: FoundCause) -> str:
    """The parameters of a cause with their 95 % intervals; undetermined ones last, by name only.

    The intervals are those of a cause that acts, so that one of a probable cause may include the nominal value.
    """
    kinds = {each.name: each for each in getattr(_effect(cause.effect), "PARAMETERS", ())}
    # the choice between two laws is no size
    sized = {name: each for name, each in cause.parameters.items() if not (name in kinds and kinds[name].either)}
    told = {name: size(name, each, kinds.get(name)) for name, each in sized.items()}
    unknown = [name for name, text in told.items() if _UNDETERMINED in text]
    if len(unknown) == len(told) and cause.probability > EVEN:
        return "; ".join(size(name, each, kinds.get(name), acts=True) for name, each in sized.items())
    if len(unknown) in (0, len(told)):
        return "; ".join(told.values())
    rest = " and ".join(title(name, kinds.get(name)) for name in unknown)
    return "; ".join([*(text for name, text in told.items() if name not in unknown), f"{rest}{_UNDETERMINED}"])


def title(name: str, parameter: Any = None) -> str:
    """The name of a parameter without its unit."""
    unit = parameter.unit.replace("/", "_per_").removeprefix("1_") if parameter is not None else ""
    return name.removesuffix(f"_{unit}").replace("_", " ") if unit else name.replace("_", " ")


def size(name: str, each: Estimate, parameter: Any = None, acts: bool = False) -> str:
    """A value with its 95 % interval; `not determined` if that includes the nominal value, unless it is said to act."""
    unit = parameter.unit if parameter is not None else ""
    nominal = parameter.nominal if parameter is not None else 0.0
    shape = acts or (parameter is not None and (bool(parameter.scan) or parameter.tolerance == 0.0))
    return f"{title(name, parameter)}{_told(each.value, each.ci95, unit, None if shape else nominal)}"


def term_size(term: LawTerm) -> str:
    """A term of a law with its coefficient."""
    return f"{shortened(term.term)}:{_told(term.value, term.ci95, term.unit, 0.0)}"


def shortened(formula: str) -> str:
    """A formula with four digits of every number."""
    return _LONG_NUMBER.sub(lambda found: f"{float(found.group()):.4g}", formula)


def _told(value: float, ci95: tuple[float, float], unit: str, nominal: float | None) -> str:
    """` 24.4 µm (23.3 to 25.5)`, or that it is not determined, where the interval includes the nominal value."""
    low, high = ci95
    scale = 1.0
    if unit in _SMALLER and max(abs(low), abs(high), abs(value)) < 1.0:
        scale, unit = _SMALLER[unit]
    behind = "" if unit in ("", "1") else f" {unit}"
    told, least, most = format_together(scale * value, scale * low, scale * high)
    if nominal is not None and low <= nominal <= high:
        return f"{_UNDETERMINED} ({least} to {most}{behind})"
    return f" {told}{behind} ({least} to {most})"


def depends(driver: Driver) -> str:
    """Text of a covariate of the gap."""
    kind, _, name = driver.covariate.partition(":")
    return _COVARIATES.get(kind, driver.covariate).format(name or "the machine")
