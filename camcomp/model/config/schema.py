"""JSON schemas (draft-07) of the YAML files including plug-ins, for editors, and of results, for their readers."""

import json
import re
from typing import Any

from pydantic import BaseModel

from camcomp.ground import shelf
from camcomp.model.config.cutting_tool import ToolTableFile
from camcomp.model.config.load import ROBOT_KEYS, params_of
from camcomp.model.config.spec import Config, EffectChoice, Experiment, ForceChoice
from camcomp.model.config.spread import SECTIONS

Schema = dict[str, Any]

_UNCERTAIN = "UncertainNumber"
_NUMBER = {"type": "number"}
_SPREAD = {
    "type": "object",
    "description": "a number that is not known exactly: normally distributed, with its standard deviation or 95 % interval; "
    "numbers of one group are drawn together",
    "properties": {
        "value": _NUMBER, "sd": {"type": "number", "minimum": 0}, "low": _NUMBER, "high": _NUMBER,
        "group": {"type": "string", "minLength": 1}, "source": {"type": "string"},
    },
    "anyOf": [{"required": ["sd"]}, {"required": ["low", "high"]}],
    "additionalProperties": False,
}  # fmt: skip
_DRAFT = "http://json-schema.org/draft-07/schema#"
_OLDER = {"$defs": "definitions", "prefixItems": "items"}  # newer name -> name in draft-07


def config_schema() -> Schema:
    """Schema of a machine file; the robot is optional, so that files of overrides pass."""
    schema = _draft07(Config.model_json_schema(by_alias=True, ref_template="#/definitions/{model}"))
    definitions = schema["definitions"]
    del schema["required"]
    general = definitions["Robot"]
    del general["properties"]["type"]
    shared = {key: general["properties"][key] for key in ROBOT_KEYS}
    _offer(definitions, "Robot", "robots", "type", shared, ["name"], first=[general])
    _offer(definitions, ForceChoice.__name__, "forces", "model", {}, [])
    target = definitions[EffectChoice.__name__]["properties"]["target"]
    _offer(definitions, EffectChoice.__name__, "effects", "effect", {"target": target}, [])
    schema["properties"]["tools"] = _or_file(schema["properties"]["tools"])
    definitions |= _uncertain(definitions, schema["properties"])
    definitions[_UNCERTAIN] = _SPREAD
    return {"$schema": _DRAFT, **schema, "title": "camcomp machine file"}


def _or_file(tools: Schema) -> Schema:
    """Tools by number, with the keys of a tool table, or the name of one alone."""
    about = {key: each for key, each in tools.items() if key in ("title", "description", "default")}
    keys = _draft07(ToolTableFile.model_json_schema(by_alias=True))["properties"]
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
        about = {key: each for key, each in value.items() if key in ("title", "description", "default")}
        number = {key: each for key, each in value.items() if key not in about}
        return {**about, "anyOf": [number, {"$ref": f"#/definitions/{_UNCERTAIN}"}]}
    return {key: _choice(each) for key, each in value.items()}


def experiment_schema() -> Schema:
    """Schema of an experiment file."""
    schema = _draft07(Experiment.model_json_schema(by_alias=True, ref_template="#/definitions/{model}"))
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
    required: list[str],
    first: list[Schema] | None = None,
) -> None:
    """Replace a definition by one alternative per member of a shelf."""
    options = list(first or [])
    for member, plugin in shelf.usable(shelf_name):
        spec: type[BaseModel] = params_of(plugin)
        # Two plug-ins may have classes of one name.
        template = f"#/definitions/{shelf_name}.{member}.{{model}}"
        one = _draft07(spec.model_json_schema(by_alias=True, ref_template=template))
        definitions.update({f"{shelf_name}.{member}.{key}": each for key, each in one.pop("definitions", {}).items()})
        one["title"] = member
        one["properties"] = {key: {"const": member}, **shared, **one["properties"]}
        one["required"] = [key, *required, *one.get("required", [])]
        options.append(one)
    definitions[name] = {"anyOf": options, "description": definitions[name].get("description", "")}


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
