"""Entries of `effects:` in machine files: which are the same one, and how those of a later file replace earlier ones."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

# Parameters that distinguish several entries of one effect and target; a law is unique by all its keys.
_APART = {"disturbance": ("from_s", "to_s"), "screw_cyclic": ("pitch_mm",), "joint_curve": ("seen_deg",)}
_LAWS = {"formula", "map"}


def merged_entries(
    base: Sequence[Any], over: Sequence[Any], data: Callable[[Any], Any] = lambda each: each
) -> list[Any]:
    """Entries of `effects:` of two files: one of the later file replaces the same one of the earlier, in its place.

    data: plain value of an entry.
    """
    out = list(base)
    keys = [key_of_entry(data(each)) for each in out]
    for each in over:
        key = key_of_entry(data(each))
        if key is not None and key in keys:
            out[keys.index(key)] = each
        else:
            out.append(each)
    return out


def key_of_entry(entry: Any) -> tuple[Any, ...] | None:
    """`key_of_effect` of an entry as in YAML; None for another node."""
    if not isinstance(entry, Mapping):
        return None
    plain = {key: certain(value) for key, value in entry.items()}
    return key_of_effect(str(plain.get("effect")), plain.get("target"), plain)


def key_of_effect(effect: str, target: str | None, values: Mapping[str, Any]) -> tuple[Any, ...]:
    """Identity of an entry of `effects:`: effect, target, and the parameters that distinguish several of a kind."""
    names = _APART.get(effect, ())
    own = tuple(str(values.get(name)) for name in names)
    return (effect, target, str(sorted(values.items(), key=str)) if effect in _LAWS else own)


def certain(value: Any) -> Any:
    """The plain value of a number that may be written as {value, sd}."""
    return value["value"] if isinstance(value, Mapping) and "value" in value else value
