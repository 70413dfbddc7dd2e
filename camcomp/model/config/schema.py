"""JSON schemas (draft-07) of the YAML files including plug-ins, for editors, and of results, for their readers."""

import json
import re
from typing import Any

from pydantic import BaseModel
from pydantic.json_schema import GenerateJsonSchema

from camcomp.ground import shelf
from camcomp.model.config.cutting_tool import ToolTableFile
from camcomp.model.config.key_reference import facts, hover_text, section_of
from camcomp.model.config.load import ROBOT_KEYS, params_of
from camcomp.model.config.spec import Config, EffectChoice, Experiment, ForceChoice
from camcomp.model.config.spread import SECTIONS

Schema = dict[str, Any]

_UNCERTAIN = "UncertainNumber"
_NUMBER = {"type": "number"}
_OF = "that of its key"
_SPREAD = {
    "type": "object",
    "description": "a number that is not known exactly: normally distributed, with its standard deviation or 95 % interval; "
    "numbers of one group are drawn together",
    "properties": {
        "value": _NUMBER | {"description": facts("the number as known", _OF, "middle of low and high", "215")},
        "sd": {"type": "number", "minimum": 0, "description": facts("its standard deviation", _OF, "none", "20")},
        "low": _NUMBER | {"description": facts("lower end of its 95 % interval", _OF, "none", "180")},
        "high": _NUMBER | {"description": facts("upper end of its 95 % interval", _OF, "none", "250")},
        "group": {"type": "string", "minLength": 1, "description": facts("name of numbers drawn together", "", "none", "force")},
        "source": {"type": "string", "description": facts("where the numbers come from", "", "none", "ballbar, 3 runs")},
    },
    "anyOf": [{"required": ["sd"]}, {"required": ["low", "high"]}],
    "additionalProperties": False,
}  # fmt: skip
_DRAFT = "http://json-schema.org/draft-07/schema#"
_OLDER = {"$defs": "definitions", "prefixItems": "items"}  # newer name -> name in draft-07


class _Described(GenerateJsonSchema):
    """Pydantic's schemas, in which every key has its meaning, unit, default and an example."""

    def model_schema(self, schema: Any) -> Schema:
        """Schema of one mapping."""
        made = super().model_schema(schema)
        spec: type[BaseModel] = schema["cls"]
        section = section_of(spec)
        for name, given in spec.model_fields.items():
            key = given.alias or name
            made["properties"][key]["description"] = hover_text(key, given, section)
            made["properties"][key].pop("title", None)
        return made


def config_schema() -> Schema:
    """Schema of a machine file; the robot is optional, so that files of overrides pass."""
    schema = _draft07(_schema_of(Config))
    definitions = schema["definitions"]
    del schema["required"]
    general = definitions["Robot"]
    del general["properties"]["type"]
    shared = {key: general["properties"][key] for key in ROBOT_KEYS}
    _offer(
        definitions=definitions,
        name="Robot",
        shelf_name="robots",
        key="type",
        shared=shared,
        required=["name"],
        first=[general],
    )
    _offer(definitions=definitions, name=ForceChoice.__name__, shelf_name="forces", key="model", shared={}, required=[])
    target = definitions[EffectChoice.__name__]["properties"]["target"]
    _offer(
        definitions=definitions,
        name=EffectChoice.__name__,
        shelf_name="effects",
        key="effect",
        shared={"target": target},
        required=[],
    )
    schema["properties"]["tools"] = _or_file(schema["properties"]["tools"])
    definitions |= _uncertain(definitions, schema["properties"])
    definitions[_UNCERTAIN] = _SPREAD
    return {"$schema": _DRAFT, **schema, "title": "camcomp machine file"}


def _schema_of(spec: type[BaseModel], template: str = "#/definitions/{model}") -> Schema:
    return spec.model_json_schema(by_alias=True, ref_template=template, schema_generator=_Described)


def _or_file(tools: Schema) -> Schema:
    """Tools by number, with the keys of a tool table, or the name of one alone."""
    about = {key: each for key, each in tools.items() if key in ("title", "description", "default", "examples")}
    keys = _draft07(_schema_of(ToolTableFile))["properties"]
    named = {key: each for key, each in tools.items() if key not in about}
    return {**about, "anyOf": [{**named, "properties": keys}, {"type": "string"}]}


def _uncertain(definitions: Schema, sections: Schema) -> Schema:
    """Definitions of the sections with uncertain numbers, in which a number may be written with its spread."""
    wanted, found = [sections[name] for name in SECTIONS], set[str]()
    while wanted:
        names = set(re.findall(r'"#/definitions/([^"]+)"', json.dumps(wanted.pop()))) - found
        found |= names
        wanted += [definitions[name] for name in names]
    return {name: _choice(definitions[name]) for name in found}


def _choice(value: Any) -> Any:
    if isinstance(value, list):
        return [_choice(each) for each in value]
    if not isinstance(value, dict):
        return value
    if value.get("type") == "number":
        about = {key: each for key, each in value.items() if key in ("title", "description", "default", "examples")}
        number = {key: each for key, each in value.items() if key not in about}
        return {**about, "anyOf": [number, {"$ref": f"#/definitions/{_UNCERTAIN}"}]}
    return {key: _choice(each) for key, each in value.items()}


def experiment_schema() -> Schema:
    """Schema of an experiment file."""
    schema = _draft07(_schema_of(Experiment))
    return {"$schema": _DRAFT, **schema, "title": "camcomp experiment file"}


def result_schema(kind: type[BaseModel], title: str) -> Schema:
    """Schema of a file that camcomp writes."""
    schema = kind.model_json_schema(mode="serialization", ref_template="#/definitions/{model}")
    return {"$schema": _DRAFT, **_draft07(schema), "title": title}


def _offer(
    definitions: Schema,
    name: str,
    shelf_name: str,
    key: str,
    shared: Schema,
    *,
    required: list[str],
    first: list[Schema] | None = None,
) -> None:
    """Replace a definition by one alternative per member of a shelf."""
    options = list(first or [])
    for member, plugin in shelf.usable(shelf_name):
        spec: type[BaseModel] = params_of(plugin)
        # Two plug-ins may have classes of one name.
        template = f"#/definitions/{shelf_name}.{member}.{{model}}"
        one = _draft07(_schema_of(spec, template))
        definitions.update({f"{shelf_name}.{member}.{key}": each for key, each in one.pop("definitions", {}).items()})
        one["title"] = member
        about = facts(_first_line(plugin), "", "required", member)
        own = {key: {"const": member, "description": about}, **shared}
        if shelf_name == "effects":
            own["target"] = _target_of(plugin, shared["target"])
        one["properties"] = {**own, **one["properties"]}
        one["required"] = [key, *required, *one.get("required", [])]
        options.append(one)
    names = [each["title"] for each in options[len(first or []) :]]
    known = {key: {"enum": names, "description": facts("which one, by its name", "", "required", names[0])}}
    if first:
        known[key]["description"] = facts("kind of machine that has keys of its own, by its name", "", "none", names[0])
    about = definitions[name].get("description", "")
    definitions[name] = {"properties": known, "anyOf": options, "description": about}  # editors offer the names


def _first_line(member: Any) -> str:
    return (member.__doc__ or "").strip().split("\n")[0].removesuffix(".")


def _target_of(effect: Any, general: Schema) -> Schema:
    """The key `target` of an effect: names where it has some, and whether it may be left out."""
    match getattr(effect, "TARGET", "either"):
        case "named":
            text = facts("axis, pair of axes or letters that err", "", "required", effect.TARGETS[0])
            return {"enum": list(effect.TARGETS), "description": text}
        case "machine":
            return {"type": "null", "description": facts("none: it concerns the machine", "", "none", "null")}
        case "actuator":
            text = facts("name of the actuator on which it acts", "", "required", "x")
        case _:
            text = facts("name of the actuator on which it acts; none: one common value for all", "", "none", "x")
    return {**general, "description": text}


def _draft07(value: Any) -> Any:
    """Pydantic's schema (2020-12) in draft-07: `definitions`, a `$ref` alone, no OpenAPI discriminators."""
    if isinstance(value, list):
        return [_draft07(each) for each in value]
    if not isinstance(value, dict):
        return value
    out = {
        _OLDER.get(key, key): _draft07(each)
        for key, each in value.items()
        if not (key == "discriminator" and isinstance(each, dict) and "propertyName" in each)
    }
    if isinstance(out.get("definitions"), dict):
        out["definitions"] = {_noun(key): each for key, each in out["definitions"].items()}
    for key in ("$ref", "title"):
        if isinstance(out.get(key), str):
            out[key] = _noun(out[key])
    if isinstance(out.get("$ref"), str) and len(out) > 1:
        return {"allOf": [{"$ref": out.pop("$ref")}], **out}
    return out


def _noun(name: str) -> str:
    """Name of a YAML mapping in the schema: Robot for the class RobotSpec."""
    return name.removesuffix("Spec") or name
