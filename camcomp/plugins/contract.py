"""Common parts of the contracts of all shelves: checks of names, functions and arguments, and guarded calls."""

import inspect
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields, is_dataclass
from difflib import get_close_matches
from functools import wraps
from types import ModuleType
from typing import Any

import numpy as np

from camcomp.ground.blame import blamed
from camcomp.ground.datatypes import Floats
from camcomp.ground.errors import ConfigError, Location


def refusal(who: str, message: str, *, at: Location | None = None, hint: str | None = None) -> ConfigError:
    """Error CC280 of a plug-in that violates its contract."""
    return ConfigError("CC280", f"{who}: {message}", at=at, hint=hint)


def failure(who: str, message: str) -> ConfigError:
    """Error CC281 of a plug-in that fails during the work."""
    return ConfigError("CC281", f"{who}: {message}")


def check_module(who: str, found: Any) -> ModuleType:
    """The module of an entry point. Raises ConfigError CC280 for other objects."""
    if not isinstance(found, ModuleType):
        raise refusal(who, f"the entry point names {described(found)}, not a module")
    return found


def check_names(who: str, module: ModuleType, needed: Mapping[str, type | tuple[type, ...]]) -> None:
    """Raise ConfigError CC280 for names of a protocol that are missing or have a wrong type."""
    for name, kind in needed.items():
        if not hasattr(module, name):
            there = [each for each in vars(module) if not each.startswith("_") and each not in needed]
            close = get_close_matches(name, there, n=1)
            meant = f"is '{close[0]}' meant for it? " if close else ""
            raise refusal(who, f"{name} is missing", hint=f"{meant}every member of this shelf has {', '.join(needed)}")
        if not isinstance(getattr(module, name), kind):
            wanted = " or ".join(each.__name__ for each in (kind if isinstance(kind, tuple) else (kind,)))
            raise refusal(who, f"{name} is {described(getattr(module, name))}, not {wanted}")


def check_functions(who: str, module: ModuleType, protocol: type, also: Sequence[str] = ()) -> tuple[str, ...]:
    """Names of the protocol's functions that a module has, in the protocol's order.

    Raises ConfigError CC280 for a public function of the module outside of the protocol (`also`: further allowed ones), and
    for arguments other than the protocol's. Arguments are passed by position; their names are free, except that a name of
    the protocol must not be at another position.
    """
    known = {name: each for name, each in vars(protocol).items() if inspect.isfunction(each) and name[0] != "_"}
    for name, value in vars(module).items():
        if name.startswith("_") or isinstance(value, type) or not callable(value):
            continue
        if getattr(value, "__module__", None) == module.__name__ and name not in known and name not in also:
            close = get_close_matches(name, [*known, *also], n=1)
            meant = f"did you mean '{close[0]}'? " if close else ""
            calls = f"camcomp calls {', '.join([*known, *also])}" if known else "camcomp calls no functions here"
            hint = f"{meant}{calls}; helpers begin with an underscore"
            raise refusal(who, f"nothing calls the function '{name}'", at=_place(value), hint=hint)
    there = tuple(name for name in known if hasattr(module, name))
    for name in there:
        function = getattr(module, name)
        if not callable(function):
            raise refusal(who, f"{name} is {described(function)}, not a function")
        _check_arguments(who, name, function, list(inspect.signature(known[name]).parameters)[1:])
    return there


def _check_arguments(who: str, name: str, function: Callable[..., Any], wanted: list[str]) -> None:
    try:
        arguments = list(inspect.signature(function).parameters.values())
    except (TypeError, ValueError):
        return  # compiled functions have no signature
    by_place = [a for a in arguments if a.kind in (a.POSITIONAL_ONLY, a.POSITIONAL_OR_KEYWORD)]
    names = [a.name for a in by_place]
    loose = any(a.kind == a.VAR_POSITIONAL for a in arguments)
    needed = [a for a in arguments if a.default is a.empty and a.kind not in (a.VAR_POSITIONAL, a.VAR_KEYWORD)]
    count = len(by_place) >= len(wanted) or loose
    asks_more = any(a not in by_place[: len(wanted)] for a in needed)
    moved = any(mine != theirs and mine in wanted for mine, theirs in zip(names, wanted, strict=False))
    if not count or asks_more or moved:
        told = f"{name}({', '.join(map(str, (a.name for a in arguments)))})"
        raise refusal(who, f"{told} has to be {name}({', '.join(wanted)})", at=_place(function))


def _place(function: Any) -> Location | None:
    code = getattr(inspect.unwrap(function), "__code__", None)
    return Location(code.co_filename, code.co_firstlineno, 1) if code is not None else None


def with_functions(module: ModuleType, functions: Mapping[str, Callable[..., Any]]) -> ModuleType:
    """A copy of a module with some functions replaced."""
    copy = ModuleType(module.__name__, module.__doc__)
    vars(copy).update(vars(module), **functions)
    return copy


def guarded(who: str, name: str, function: Callable[..., Any], sound: Callable[..., str]) -> Callable[..., Any]:
    """`function` with errors and invalid results as ConfigError CC281; `sound(result, *arguments)` returns the error text.

    The first argument, if an array, is read-only in the call, because camcomp uses it afterwards.
    """
    at_work = f"{who}: {name}"

    @wraps(function)
    def guard(first: Any, *rest: Any) -> Any:
        shown = first
        if isinstance(first, np.ndarray):
            shown = first.view()
            shown.flags.writeable = False
        with blamed(at_work):
            result = function(shown, *rest)
            if result is shown:
                return first
            wrong = sound(result, first, *rest)
        if wrong:
            raise failure(who, f"{name} returned {wrong}")
        return result

    return guard


def wrong_array(result: Any, like: Floats, *given: Any) -> str:
    """Error text for a result that is no finite array of the shape of `like`; empty: valid."""
    if not isinstance(result, np.ndarray) or result.shape != like.shape:
        return f"{described(result)}, not an array {like.shape}"
    if result.dtype.kind not in "fiu":
        return f"an array of {result.dtype}, not of floats"
    bad = ~np.isfinite(result)
    if bad.any() and not has_nan((like, *given)):
        place = [int(each[0]) for each in np.nonzero(bad)]
        return f"{result[tuple(place)]} at {place}"
    return ""


def has_nan(value: Any) -> bool:
    """Whether arrays, numbers, or records and collections of them hold a NaN."""
    if isinstance(value, np.ndarray):
        return value.dtype.kind == "f" and bool(np.isnan(value).any())
    if isinstance(value, float):
        return math.isnan(value)
    if isinstance(value, Mapping):
        return any(has_nan(each) for each in value.values())
    if isinstance(value, (tuple, list)):
        return any(has_nan(each) for each in value)
    if is_dataclass(value):
        return any(has_nan(getattr(value, each.name)) for each in fields(value))
    return False


def same(a: Any, b: Any) -> bool:
    """Whether two values are equal bit for bit, arrays and records of them included."""
    if a is b:
        return True
    if isinstance(a, np.ndarray) or isinstance(b, np.ndarray):
        return np.shape(a) == np.shape(b) and bool(np.array_equal(a, b, equal_nan=True))
    if type(a) is not type(b):
        return False
    if is_dataclass(a):
        return all(same(getattr(a, each.name), getattr(b, each.name)) for each in fields(a))
    if isinstance(a, (tuple, list)):
        return len(a) == len(b) and all(map(same, a, b))
    return bool(a == b)


def described(value: Any) -> str:
    """Short text for a value, for messages."""
    if isinstance(value, np.ndarray):
        return f"an array {value.shape}"
    if value is None or isinstance(value, (bool, int, float, str)):
        return repr(value)[:60]
    return f"a {type(value).__name__}"
