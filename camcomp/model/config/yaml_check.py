"""Check of a YAML tree against a spec: pydantic's findings as messages with rule ids, locations and hints."""

from collections.abc import Sequence
from difflib import get_close_matches
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from camcomp.ground.errors import CamcompError, ConfigError
from camcomp.ground.records import dataclass, replace
from camcomp.ground.rules import RULES
from camcomp.model.config.base import Spec
from camcomp.model.config.yaml_tree import Node, child, plain

Model = TypeVar("Model", bound=BaseModel)
Keys = tuple[str | int, ...]

_UNIT_WORDS = {"mm", "mm2", "mm4", "N", "Nmm", "per", "rad", "deg", "s", "um", "rpm"}
_RULES = {
    "missing": "CC203",
    "union_tag_not_found": "CC203",
    "extra_forbidden": "CC201",
    "invalid_key": "CC201",
    "finite_number": "CC206",
}
_PYDANTIC_WORDS = {
    "Input ": "",
    "String ": "",
    "should be a valid": "has to be a",
    "should be": "has to be",
    "should have": "has to have",
    "should match": "has to match",
}


def check(
    spec: type[Model], tree: Node, data: Any = None, *, name: str = "", skip: Sequence[str] = ()
) -> tuple[Model | None, list[CamcompError]]:
    """`tree` as a `spec`, or None, and all errors with their locations in the YAML text.

    `data` replaces the plain values of the tree if some are built already; `name` is the tree's name in messages; errors of
    the top-level keys in `skip` are omitted.
    """
    seen: dict[int, type[Spec]] = {}
    data = plain(tree) if data is None else data
    try:
        return spec.model_validate(data, context=seen), []
    except ValidationError as error:
        details = [each for each in error.errors(include_url=False) if not set(each["loc"][:1]) & set(skip)]
    return None, _Findings(tree, data, seen, name).errors(details)


OTHER_NAMES = {"offset_deg": "theta_deg", "offset": "theta_deg", "theta_offset_deg": "theta_deg"}  # of DH tables


def choose(name: Any, known: Sequence[str]) -> str:
    """Hint for an unknown name: the nearest ones of `known`."""
    same = [each for key, each in OTHER_NAMES.items() if key == name and each in known]
    close = same or get_close_matches(str(name), known, n=1)
    start = f"did you mean '{close[0]}'? " if close else ""
    return f"{start}known here: {', '.join(known)}"


@dataclass(frozen=True)
class _Findings:
    """Pydantic's findings about one tree. `seen`: id of a mapping -> the spec it was checked against."""

    tree: Node
    data: Any
    seen: dict[int, type[Spec]]
    name: str

    def errors(self, details: list[ErrorDetails]) -> list[CamcompError]:
        meant = {
            (each["loc"][:-1], key)
            for each in details
            if _rule(each) == "CC201"
            for key in self._meant(str(each["loc"][-1]), each["loc"][:-1])
        }
        found: dict[Any, CamcompError] = {}
        for detail in details:
            if detail["type"] == "missing" and (detail["loc"][:-1], detail["loc"][-1]) in meant:
                continue  # present, with a misspelt key that has its own error
            each = self._explain(detail)
            # An anchor used in three chains is one mistake, and so is a value that fits neither of two types.
            which = detail["loc"][-1] if each.rule == "CC203" else None
            found.setdefault((each.rule, each.at, which), each)
        return list(found.values())

    def _explain(self, detail: ErrorDetails) -> CamcompError:
        kind, loc, context = detail["type"], detail["loc"], detail.get("ctx", {})
        rule = _rule(detail)
        name, node, value = self._walk(loc)
        if "below" in context:  # an error between parts, located at one of them
            node = self._walk((*loc, *context["below"]))[1]
        if rule == "CC201":
            return self._unknown_key(str(loc[-1]), loc[:-1], node)
        at = node.key_at if node.key_at and (isinstance(node.value, dict) or loc[-1:] == ("[key]",)) else node.at
        if rule == "CC203":
            key = str(context.get("discriminator", loc[-1])).strip("'")
            return ConfigError(rule, f"{name} lacks the key '{key}'", at=at)
        if kind == "union_tag_invalid":
            tag = node.value[str(context["discriminator"]).strip("'")]
            hint = choose(tag.value, _quoted(context["expected_tags"]))
            return ConfigError(rule, f"{name}: '{tag.value}' is not known", at=tag.at, hint=hint)
        if kind == "literal_error":
            hint = choose(value, _quoted(context["expected"].replace(" or ", ",")))
            return ConfigError(rule, f"{name}: '{value}' is not known", at=at, hint=hint)
        if kind in ("too_short", "too_long"):
            limit = context.get("min_length", context.get("max_length"))
            return ConfigError(rule, f"{name}: has to have {limit} items, not {context['actual_length']}", at=at)
        if kind in ("model_type", "dict_type"):
            what = {type(None): "nothing", list: "a list"}.get(type(node.value), f"'{node.value}'")
            return ConfigError(rule, f"{name}: has to be a mapping (key: value), not {what}", at=at)
        if at is not None and "offset" in context:  # within a text with its own parser
            quoted = at.source[at.column - 1 : at.column] in ("'", '"')
            at = replace(at, column=at.column + int(context["offset"]) + quoted)
        words = detail["msg"]
        for theirs, ours in _PYDANTIC_WORDS.items():
            words = words.replace(theirs, ours)
        return ConfigError(rule, f"{name}: {words}", at=at)

    def _unknown_key(self, key: str, above: Keys, node: Node) -> CamcompError:
        at = node.key_at or node.at
        with_unit = [each for each in self._meant(key, above) if each.startswith(f"{key}_")]
        if with_unit:
            hint = f"write {' or '.join(with_unit)}"
            return ConfigError("CC202", f"unit missing in key '{key}'", at=at, hint=hint)
        message = f"unknown key '{key}' in {self._walk(above)[0]}"
        return ConfigError("CC201", message, at=at, hint=choose(key, self._known(above)))

    def _meant(self, key: str, above: Keys) -> list[str]:
        """Known keys that an unknown key may mean: with its unit added, else of similar spelling."""
        known = self._known(above)
        units = [
            each for each in known if each.startswith(f"{key}_") and each[len(key) + 1 :].split("_")[0] in _UNIT_WORDS
        ]
        return units or get_close_matches(key, known, n=1)

    def _known(self, loc: Keys) -> list[str]:
        spec = self.seen.get(id(self._walk(loc)[2]))
        return [key for key in spec.yaml_keys() if key != "source"] if spec else []

    def _walk(self, loc: Keys) -> tuple[str, Node, Any]:
        """Dotted name, node and plain value under `loc`; parts that are no keys (tags of unions) are skipped."""
        name, node, data = self.name, self.tree, self.data
        for part in loc:
            below = child(node, part)
            if below is not None:
                name += f"[{int(part) + 1}]" if isinstance(node.value, list) else f".{part}"
                data = data[part] if isinstance(data, dict | list) else None  # type: ignore[index]
                node = below
        return name.removeprefix(".") or "the file", node, data


def _rule(detail: ErrorDetails) -> str:
    kind = detail["type"]
    if kind in RULES:
        return kind
    return _RULES.get(kind, "CC204" if kind.endswith(("_type", "_parsing")) else "CC205")


def _quoted(text: str) -> list[str]:
    """The names in pydantic's enumeration 'a', 'b'."""
    return [each.strip("' ") for each in text.split(",")]
