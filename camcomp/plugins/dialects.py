"""Contract of dialects, checked when a user's dialect is loaded."""

import re
from collections.abc import Mapping
from types import ModuleType
from typing import Any, Protocol

from camcomp.gcode.dialect import Dialect
from camcomp.gcode.spelling import Spelling
from camcomp.ground.records import fields
from camcomp.plugins.contract import check_functions, check_module, check_names, described, refusal

FLOWS = ("", "o-words", "macro", "sinumerik")
_KINDS: dict[Any, type] = {bool: bool, str: str, float: float, "bool": bool, "str": str, "float": float}


class DialectPlugin(Protocol):
    """The language of one controller, as data. The entry point may name the record itself."""

    DIALECT: Dialect


class _NoFunctions(Protocol):
    """Functions of a dialect: a dialect is data and has none."""


def checked(name: str, found: Any, who: str) -> Any:
    """The dialect behind an entry point. Raises ConfigError CC280."""
    if isinstance(found, Dialect):
        _check_record(who, name, found)
        return found
    module: ModuleType = check_module(who, found)
    check_names(who, module, {"DIALECT": Dialect})
    check_functions(who, module, _NoFunctions)
    _check_record(who, name, module.DIALECT)
    return module


def _check_record(who: str, name: str, record: Dialect) -> None:
    if record.name != name:
        raise refusal(who, f"DIALECT is called '{record.name}' and its entry point '{name}'")
    for each in fields(record):
        value, kind = getattr(record, each.name), _KINDS.get(each.type)
        if kind is not None and not isinstance(value, (int, float) if kind is float else kind):
            raise refusal(who, f"DIALECT.{each.name} is {described(value)}, not {kind.__name__}")
    if why := _wrong(record):
        raise refusal(who, f"DIALECT.{why}")


def _wrong(record: Dialect) -> str:
    """Error text for an invalid record; empty: valid."""
    marks: Any = record.marks
    for mark in marks if isinstance(marks, tuple) else (marks,):
        try:
            pattern, weight = mark
            re.compile(pattern)
            if not weight > 0:
                return f"marks: the weight of {pattern!r} is not above zero"
        except (re.error, TypeError, ValueError) as error:
            return f"marks: {mark!r} is no pair of a regular expression and a weight ({error})"
    spelling: Any = record.spelling
    if spelling is not None and not isinstance(spelling, Spelling):
        return f"spelling is {described(spelling)}, not a Spelling or None"
    if record.flow not in FLOWS:
        return f"flow is '{record.flow}', not one of {FLOWS}"
    if len(record.comment) != 2 or not all(isinstance(each, str) for each in record.comment) or not record.comment[0]:
        return "comment is no pair of what begins and what ends one"
    for key in ("more", "without", "passed", "more_offsets"):
        codes = getattr(record, key)
        if not isinstance(codes, Mapping if key.startswith("more") else (set, frozenset)):
            return f"{key} is {described(codes)}"
        if odd := [each for each in codes if type(each) is not int]:
            return f"{key} has {odd[0]!r} where a code in tenths is due (G59.1 is 591)"
    if both := (set(record.without) | set(record.passed)) & set(record.more):
        return f"more has {min(both)}, and so has without or passed"
    return ""
