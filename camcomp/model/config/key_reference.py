"""Every key of the YAML files with its unit, default, meaning and an example, from the specs themselves.

The reference page and the schemas are made of it. Examples are those of the files that camcomp ships; for a key that none of them has there is one below.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from functools import cache
from types import NoneType
from typing import Any, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from camcomp.ground import shelf
from camcomp.ground.files import shipped
from camcomp.ground.records import dataclass, field
from camcomp.model.config.base import Spec
from camcomp.model.config.cutting_tool import ToolTableFile
from camcomp.model.config.load import params_of
from camcomp.model.config.spec import Config, EffectChoice, Experiment, ForceChoice
from camcomp.model.config.yaml_text import read_tree
from camcomp.model.config.yaml_tree import Node, plain

SOURCE = "source"  # key of every mapping, described once
_UNIT = re.compile(r"(?:^|_)((?:mm[24]?|um|Nmm|N|rad|deg|s|ms|min|rpm|kg|C|ppm|mrad)(?:_per_[A-Za-z]+2?)?)$")
_SPELLED = {"C": "°C", "mm2": "mm²", "mm4": "mm⁴"}
_CHOICES = {ForceChoice: ("forces", "model"), EffectChoice: ("effects", "effect")}

_EXAMPLES = {
    "compliance_mm_N_rad": "[[2e-5, 0, 0, 0, 0, 0], ...]",
    "start_mm": "0",
    "stiffness_mm_N_rad": "[[5e4, 0, 0, 0, 0, 0], ...]",
    "translation_N_per_mm": "[2e4, 2e4, 5e4]",
    "rotation_Nmm_per_rad": "[2e7, 2e7, 2e7]",
    "G_N_per_mm2": "26300",
    "width_mm": "40",
    "height_mm": "60",
    "diameter_mm": "30",
    "area_mm2": "900",
    "joint": "revolute",
    "home_deg": "0",
    "stiffness_N_per_mm": "1e4",
    "stiffness_Nmm_per_rad": "2e8",
    "axis": "z",
    "name": "z",
    "home_mm": "-300",
    "limits_mm": "[-400, 0]",
    "limits_deg": "[-170, 170]",
    "rotation_deg": "15",
    "rotation_vector_deg": "[0, 0, 15]",
    "stock_top_mm": "0",
    "vector_mm": "[0, 0, 100]",
    "turn_deg": "90",
    "temperature_C": "31",
    "radial_ratio": "0.4",
    "axial_ratio": "0.2",
    "file": "forces.csv",
    "dialect": "fanuc",
    "offsets_mm": "{G55: [100, 0, 0]}",
    "tool_lengths_mm": "{1: 87.4}",
    "reference_positions_mm": "{G28: [0, 0, 150]}",
    "table_axes": "[A]",
    "input_increment_mm": "0.001",
    "velocity_mm_per_s": "100",
    "path_mode": "G64 P0.01",
    "arcs": "true",
    "effect": "backlash",
    "target": "x",
    "clock": "tracker",
    "tip_mm": "0.003",
    "encoder_mm": "0.0005",
    "encoder_rad": "0.00001",
    "force_Nmm": "500",
    "force_N": "2",
    "side_mm": "15",
    "outer_diameter_mm": "16",
    "inner_diameter_mm": "12",
    "min_mm": "[-50, -50, -20]",
    "max_mm": "[50, 50, 0]",
    "resolution_mm": "0.5",
    "bottom_mm": "-20",
    "top_mm": "0",
    "corner_radius_mm": "1",
    "point_deg": "118",
    "flute_length_mm": "24",
    "teeth": "3",
    "comp_type": "0",
    "positions_mm": "[0, 100, 200]",
    "forward_um": "[0, 4.5, 7]",
    "reverse_um": "[1, 5.2, 7.4]",
    "forward_mrad": "[0, 0.02, 0.03]",
    "reverse_mrad": "[0, 0.03, 0.04]",
    "sine": "[1, 0.3]",
    "cosine": "[0, 0.2]",
    "seen_deg": "[[-90, 90]]",
    "band_rad": "[1e-5, 2e-5]",
    "formula": "0.002 * sin(x_mm / 20)",
    "envelope": "{x_mm: [-100, 100]}",
    "over": "[x_mm]",
    "coefficients_mm": "[0, 0.003, 0.001, 0]",
    "end_error": "{rotation_deg: [0, 0, 0.01]}",
    "effects": "[{effect: backlash, target: x, width_mm: 0.02}]",
    "compliance_diagonal": "{translation_mm_per_N: [1e-5, 1e-5, 2e-5], rotation_rad_per_Nmm: [0, 0, 0]}",
    "stiffness_diagonal": "{translation_N_per_mm: [1e5, 1e5, 5e4], rotation_Nmm_per_rad: [1e8, 1e8, 1e8]}",
    "link": "{stiffness_diagonal: {translation_N_per_mm: [1e5, 1e5, 5e4], rotation_Nmm_per_rad: [1e8, 1e8, 1e8]}}",
    "sd": "{tip_mm: 0.003}",
}
_MAPPINGS = {"": "mapping, below", "[]": "list of mappings, below", ".NAME": "mappings by name, below"}


@dataclass
class KeySection:
    """One mapping of a YAML file. paths: its possible paths; picked: the keys that choose it among others."""

    spec: type[BaseModel]
    paths: list[str]
    picked: dict[str, str] = field(default_factory=dict)
    note: str = ""


@dataclass(frozen=True, kw_only=True)
class KeyRow:
    """One key. unit, default: may be empty; example: as YAML, empty for a value that is a mapping."""

    key: str
    unit: str
    value: str
    default: str
    meaning: str
    example: str


def unit_of(key: str) -> str:
    """Unit at the end of a key's name."""
    if key.endswith("_mm_N_rad"):
        return "mm, N, rad"
    found = _UNIT.search(key)
    if found is None:
        return ""
    over, _, under = found[1].partition("_per_")
    parts = [_SPELLED.get(each, each.replace("2", "²")) for each in (over, under) if each]
    return "/".join(parts)


def sections(root: type[BaseModel]) -> list[KeySection]:
    """Every mapping of a file, the file itself first."""
    found: dict[tuple[type[BaseModel], tuple[tuple[str, str], ...]], KeySection] = {}

    def visit(spec: type[BaseModel], path: str, picked: dict[str, str], note: str = "") -> None:
        key = (spec, tuple(picked.items()))
        if key in found:
            if path not in found[key].paths:
                found[key].paths.append(path)
            return
        found[key] = KeySection(spec, [path], picked, note)
        for name, each in spec.model_fields.items():
            below = each.alias or name
            if (spec, name) == (Config, "tools"):
                visit(ToolTableFile, "tools", {})
            for kind, where in _specs_in(each.annotation, f"{path}.{below}" if path else below):
                visit(kind, where, _picks(kind))
        if spec in _CHOICES:
            shelf_name, word = _CHOICES[spec]
            _visit_shelf(shelf_name, word, path)
        if path == "robot":
            _visit_shelf("robots", "type", path)

    def _visit_shelf(shelf_name: str, word: str, path: str) -> None:
        if shelf_name == "effects":
            return  # library.md lists their parameters with ranges and sources
        for member, module in shelf.usable(shelf_name):
            params = params_of(module)
            if set(params.model_fields) - {SOURCE}:
                visit(params, path, {word: member})

    visit(root, "", {})
    return list(found.values())


def _specs_in(kind: Any, path: str) -> Iterator[tuple[type[BaseModel], str]]:
    """Mappings inside the type of a field, each with its path."""
    if isinstance(kind, type) and issubclass(kind, BaseModel):
        yield kind, path
        return
    origin, inner = get_origin(kind), [each for each in get_args(kind) if each is not NoneType]
    if hasattr(kind, "__metadata__"):
        yield from _specs_in(origin if not inner else inner[0], path)
    elif origin is list:
        yield from _specs_in(inner[0], f"{path}[]")
    elif origin is dict:
        yield from _specs_in(inner[1], f"{path}.NAME")
    else:
        for each in inner:
            yield from _specs_in(each, path)


def _picks(spec: type[BaseModel]) -> dict[str, str]:
    """Keys with one possible value, which distinguish alternative mappings."""
    out = {}
    for name, each in spec.model_fields.items():
        words = get_args(each.annotation)
        if each.is_required() and len(words) == 1 and isinstance(words[0], str):
            out[each.alias or name] = words[0]
    return out


def rows(section: KeySection) -> list[KeyRow]:
    """The keys of a mapping in their order, except those that choose it and `source`."""
    out = []
    for name, each in section.spec.model_fields.items():
        key = each.alias or name
        if key in section.picked or (key == SOURCE and issubclass(section.spec, Spec)):
            continue
        deeper = next((where for _, where in _specs_in(each.annotation, "")), None)
        default = "required" if each.is_required() else "" if deeper is not None else default_text(each)
        example = "" if deeper is not None else example_of(key, each, section)
        value = type_text(each) if deeper is None else _MAPPINGS[deeper]
        out.append(
            KeyRow(
                key=key,
                unit=unit_of(key),
                value=value,
                default=default,
                meaning=each.description or "",
                example=example,
            )
        )
    return out


def title(section: KeySection, root: str) -> str:
    """Title of a mapping: its path, and the keys that choose it."""
    path = " and ".join(f"`{each}`" for each in section.paths if each) or root
    words = ", ".join(f"`{key}: {value}`" for key, value in section.picked.items())
    return f"{path} with {words}" if words else path


def type_text(given: FieldInfo) -> str:
    """Name of a type for users."""
    return _type_name(given.annotation).removesuffix(" or nothing")


def _type_name(kind: Any) -> str:
    plain_names = {float: "number", int: "whole number", str: "text", bool: "true or false", NoneType: "nothing"}
    if kind in plain_names:
        return plain_names[kind]
    if isinstance(kind, type) and issubclass(kind, BaseModel):
        return f"mapping ({', '.join(kind.model_fields)})"
    inner = list(getattr(kind, "__args__", ()))
    origin = getattr(kind, "__origin__", None)
    if origin is list:
        return f"list of {_type_name(inner[0])}"
    if origin is dict:
        return "mapping"
    if hasattr(kind, "__metadata__"):
        return _type_name(origin)
    if inner and all(isinstance(each, str) for each in inner):
        return " or ".join(f"`{each}`" for each in inner)
    return " or ".join(dict.fromkeys(_type_name(each) for each in inner)) or "value"


def default_text(given: FieldInfo) -> str:
    """A default as YAML, or empty."""
    value = given.get_default(call_default_factory=True)
    if value is None or isinstance(value, BaseModel):
        return ""
    return f"{value:g}" if isinstance(value, float) else str(value)


def example_of(key: str, given: FieldInfo, section: KeySection) -> str:
    """A value that a file may have, as YAML in one line; empty without an example."""
    if len(words := get_args(given.annotation)) == 1 and isinstance(words[0], str):
        return words[0]
    if given.examples:
        return _flow(given.examples[0])
    shown = _shipped_examples()
    for path in section.paths:
        for words in (tuple(sorted(section.picked.values())), ()):
            if (path, words, key) in shown:
                return shown[path, words, key]
    if key in _EXAMPLES:
        return _EXAMPLES[key]
    parts = (given.annotation, *get_args(given.annotation))
    if named := [each for part in parts for each in get_args(part) if isinstance(each, str)]:
        return named[0]
    default = None if given.is_required() else given.get_default(call_default_factory=True)
    if isinstance(default, bool):
        return _flow(not default)
    return "" if default in (None, [], {}) or isinstance(default, BaseModel) else _flow(default)


@cache
def _shipped_examples() -> dict[tuple[str, tuple[str, ...], str], str]:
    """First value of every key in the shipped files by path, keys that choose its mapping, and key."""
    out: dict[tuple[str, tuple[str, ...], str], str] = {}

    def walk(node: Any, path: str) -> None:
        if isinstance(node, list):
            for each in node:
                walk(each, f"{path}[]")
        if not isinstance(node, dict):
            return
        words = tuple(sorted(str(node[each]) for each in ("type", "joint", "model") if isinstance(node.get(each), str)))
        for key, value in node.items():
            if _is_leaf(value):
                out.setdefault((path, words, str(key)), _flow(value))
                out.setdefault((path, (), str(key)), _flow(value))
            walk(value, f"{path}.{'NAME' if path.endswith('chains') else key}" if path else str(key))

    for path in [*sorted(shipped("config").rglob("*.yaml")), *sorted(shipped("samples").rglob("*.yaml"))]:
        tree, _ = read_tree(path.read_bytes(), path.name)
        if isinstance(tree, Node):
            walk(plain(tree), "")
    return out


def _is_leaf(value: Any) -> bool:
    if isinstance(value, list):
        return all(_is_leaf(each) for each in value)
    return value is not None and (not isinstance(value, dict) or all(_is_leaf(each) for each in value.values()))


def _flow(value: Any) -> str:
    """A value as YAML in one line."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key}: {_flow(each)}" for key, each in value.items()) + "}"
    if isinstance(value, list | tuple):
        if value and isinstance(value[0], list):
            return f"[{_flow(value[0])}, ...]"
        return "[" + ", ".join(_flow(each) for each in value) + "]"
    if isinstance(value, float):
        return f"{value:g}"
    text = str(value)
    return json.dumps(text, ensure_ascii=False) if re.search(r"[:,#{}\[\]]", text) else text


def hover_text(key: str, given: FieldInfo, section: KeySection) -> str:
    """Meaning, unit, default and example of a key in one paragraph, for editors."""
    meaning = given.description or ""
    if len(words := get_args(given.annotation)) == 1 and isinstance(words[0], str) and not meaning:
        meaning = (section.spec.__doc__ or "").strip().split("\n")[0].removesuffix(".")
    default = "required" if given.is_required() else default_text(given) or "none"
    return facts(meaning, unit_of(key), default, example_of(key, given, section))


def facts(meaning: str, unit: str, default: str, example: str) -> str:
    """The parts of a hover text in their order."""
    return f"{meaning}. Unit: {unit or 'none'}. Default: {default}. Example: {example}"


def section_of(spec: type[BaseModel]) -> KeySection:
    """The mapping that a spec describes, where it may stand in either file."""
    return _sections().get(spec) or KeySection(spec, [])


@cache
def _sections() -> dict[type[BaseModel], KeySection]:
    found = {each.spec: each for _, root in reversed(ROOTS) for each in reversed(sections(root))}
    return found


ROOTS = (("The machine file", Config), ("The experiment file", Experiment))
