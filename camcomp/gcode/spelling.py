"""Notation of expressions in dialects, as data: brackets, parameters, functions, operators."""

import math
from collections.abc import Callable

from camcomp.ground.records import dataclass


@dataclass(frozen=True, kw_only=True)
class Spelling:
    """Notation of expressions in one dialect."""

    opening: str  # of a group
    closing: str
    sigil: str  # of a parameter
    functions: dict[str, Callable[[float], float]]
    operators: tuple[tuple[str, ...], ...]  # by rising precedence
    named: bool  # `#<name>`


def _degrees(function: Callable[[float], float]) -> Callable[[float], float]:
    return lambda x: function(math.radians(x))


def _inverse(function: Callable[[float], float]) -> Callable[[float], float]:
    return lambda x: math.degrees(function(x))


def _round(x: float) -> float:
    return math.copysign(math.floor(abs(x) + 0.5), x)


_COMMON: dict[str, Callable[[float], float]] = {
    "ABS": abs,
    "ACOS": _inverse(math.acos),
    "ASIN": _inverse(math.asin),
    "ATAN": _inverse(math.atan),
    "COS": _degrees(math.cos),
    "EXP": math.exp,
    "FIX": math.floor,
    "FUP": math.ceil,
    "LN": math.log,
    "ROUND": _round,
    "SIN": _degrees(math.sin),
    "SQRT": math.sqrt,
    "TAN": _degrees(math.tan),
}
RS274 = Spelling(
    opening="[",
    closing="]",
    sigil="#",
    functions=_COMMON,
    operators=(
        ("AND", "OR", "XOR"),
        ("EQ", "NE", "GT", "GE", "LT", "LE"),
        ("+", "-"),
        ("*", "/", "MOD"),
        ("**",),
    ),
    named=True,
)
FANUC = Spelling(
    opening="[",
    closing="]",
    sigil="#",
    functions={**_COMMON, "FIX": math.trunc, "RND": _round, "SQR": math.sqrt},
    operators=(("EQ", "NE", "GT", "GE", "LT", "LE"), ("+", "-", "OR", "XOR"), ("*", "/", "MOD", "AND")),
    named=False,
)
SINUMERIK = Spelling(
    opening="(",
    closing=")",
    sigil="R",
    functions={
        **{name: _COMMON[name] for name in ("ABS", "ACOS", "ASIN", "COS", "EXP", "LN", "ROUND", "SIN", "SQRT", "TAN")},
        "POT": lambda x: x * x,
        "TRUNC": math.trunc,
    },
    operators=(
        ("OR", "XOR"),
        ("AND",),
        ("==", "<>", ">=", "<=", ">", "<"),
        ("+", "-"),
        ("*", "/", "DIV", "MOD"),
    ),
    named=False,
)
