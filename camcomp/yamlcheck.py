"""A YAML tree against a spec: pydantic's findings in words for a machine builder, with rule ids, places and hints."""

from collections.abc import Sequence
from difflib import get_close_matches
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from camcomp.diagnostics import CamcompError, ConfigError
from camcomp.rules import RULES
from camcomp.specbase import Spec
from camcomp.yamltree import Node, child, plain

Model = TypeVar("Model", bound=BaseModel)
Keys = Sequence[str | int]

_UNITS = {"mm", "mm2", "mm4", "N", "Nmm", "per", "rad", "deg", "s", "um", "rpm"}
_RULES = {
    "missing": "CC203",
    "union_tag_not_found": "CC203",
    "extra_forbidden": "CC201",
    "invalid_key": "CC201",
    "finite_number": "CC206",
}


def check(
    spec: type[Model], tree: Node, data: Any = None, *, name: str = "", skip: Sequence[str] = ()
) -> tuple[Model | None, list[CamcompError]]:
    """`tree` as a `spec`, or None and every error with its place in the YAML text.

    `name` is what the tree is called in messages; `data` replaces the bare values of the tree where some of them are built already; what is wrong with the top-level
    keys in `skip` is left out.
    """
    seen: dict[int, type[Spec]] = {}
    data = plain(tree) if data is None else data
    try:
        return spec.model_validate(data, context=seen), []
    except ValidationError as error:
        details = [
            each
            for each in error.errors(include_url=False)
            if each["loc"][:1] not in [(key,) for key in skip]
        ]
    found: dict[Any, CamcompError] = {}
    for detail in details:
        each = _explain(detail, tree, data, seen, name)
        # An anchor used in three chains is one mistake, and so is a value that fits neither of two types.
        which = detail["loc"][-1] if each.rule == "CC203" else None
        found.setdefault((each.rule, each.at, which), each)
    return None, list(found.values())


def choose(name: Any, known: Sequence[str]) -> str:
    """Hint for a name that is not among `known`."""
    close = get_close_matches(str(name), known, n=1)
    start = f"did you mean '{close[0]}'? " if close else ""
    return f"{start}known here: {', '.join(known)}"


def _explain(
    detail: ErrorDetails, tree: Node, data: Any, seen: dict[int, type[Spec]], prefix: str
) -> CamcompError:
    kind, loc, context = detail["type"], detail["loc"], detail.get("ctx", {})
    rule = (
        kind
        if kind in RULES
        else _RULES.get(kind, "CC204" if kind.endswith(("_type", "_parsing")) else "CC205")
    )
    name, node, value = _walk(loc, tree, data, prefix)
    if rule == "CC201":
        key = str(loc[-1])
        inside, _, parent = _walk(loc[:-1], tree, data, prefix)
        return _unknown_key(key, inside, node, seen.get(id(parent)))
    if rule == "CC203":
        key = str(context.get("discriminator", loc[-1])).strip("'")
        return ConfigError(rule, f"{name} lacks the key '{key}'", at=node.key_at or node.at)
    if kind == "union_tag_invalid":
        key = str(context["discriminator"]).strip("'")
        tags = [each.strip("' ") for each in str(context["expected_tags"]).split(",")]
        tag = node.value[key]
        return ConfigError(
            rule, f"{name}.{key}: '{tag.value}' is not known", at=tag.at, hint=choose(tag.value, tags)
        )
    if kind == "literal_error":
        names = [each.strip("' ") for each in str(context["expected"]).replace(" or ", ",").split(",")]
        return ConfigError(rule, f"{name}: '{value}' is not known", at=node.at, hint=choose(value, names))
    if kind in ("too_short", "too_long"):
        limit = context.get("min_length", context.get("max_length"))
        return ConfigError(
            rule, f"{name}: has to have {limit} items, not {context['actual_length']}", at=node.at
        )
    if kind in ("model_type", "dict_type"):
        what = (
            "nothing"
            if node.value is None
            else "a list"
            if isinstance(node.value, list)
            else f"'{node.value}'"
        )
        return ConfigError(rule, f"{name}: has to be a mapping (key: value), not {what}", at=node.at)
    if loc and loc[-1] == "[key]":
        return ConfigError(rule, f"{name}: {_words(detail['msg'])}", at=node.key_at or node.at)
    return ConfigError(rule, f"{name}: {_words(detail['msg'])}", at=node.at)


def _unknown_key(key: str, inside: str, node: Node, spec: type[Spec] | None) -> CamcompError:
    at = node.key_at or node.at
    known = [each for each in spec.yaml_keys() if each != "source"] if spec else []
    with_unit = [
        each for each in known if each.startswith(f"{key}_") and each[len(key) + 1 :].split("_")[0] in _UNITS
    ]
    if with_unit:
        return ConfigError(
            "CC202", f"unit missing in key '{key}'", at=at, hint=f"write {' or '.join(with_unit)}"
        )
    return ConfigError(
        "CC201", f"unknown key '{key}' in {inside}", at=at, hint=choose(key, known) if known else None
    )


def _walk(loc: Keys, tree: Node, data: Any, prefix: str) -> tuple[str, Node, Any]:
    """Dotted name, node and bare value under `loc`; parts that are no keys (tags of unions) are passed over."""
    name, node = prefix, tree
    for part in loc:
        below = child(node, part)
        if below is not None:
            name += f"[{int(part) + 1}]" if isinstance(node.value, list) else f".{part}"
            data = data[part] if isinstance(data, dict | list) else None  # type: ignore[index]
            node = below
    return name.removeprefix(".") or "the file", node, data


def _words(message: str) -> str:
    message = message.removeprefix("Input ").removeprefix("Value error, ")
    for pydantic, ours in (
        ("should be a valid list", "has to be a list"),
        ("should be a valid", "has to be a"),
        ("should have", "has to have"),
        ("should be", "has to be"),
        ("should match", "has to match"),
    ):
        message = message.replace(pydantic, ours)
    return message
