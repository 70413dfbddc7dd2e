"""Every key of the YAML files has its meaning, unit, default and an allowed example in the schema."""

import functools
import re

import jsonschema
import pytest

from camcomp.api.settings import schema_of
from camcomp.model.config.key_reference import unit_of
from camcomp.model.config.yaml_text import read_tree
from camcomp.model.config.yaml_tree import plain

TEXT = re.compile(
    r"(?P<meaning>.{3,})\. Unit: (?P<unit>\S.*?)\. Default: (?P<default>.+)\. Example: (?P<example>.+)", re.DOTALL
)


@functools.cache
def properties(kind):
    """(mapping, key, its schema) of every property."""
    out = []

    def walk(node, where):
        if isinstance(node, list):
            for each in node:
                walk(each, where)
        elif isinstance(node, dict):
            where = node.get("title", where)
            out.extend((where, key, each) for key, each in node.get("properties", {}).items())
            for each in node.values():
                walk(each, where)

    walk(schema_of(kind), kind)
    return out


@pytest.mark.parametrize(("kind", "least"), [("config", 400), ("experiment", 17)])
def test_every_key_has_meaning_unit_default_and_example(kind, least):
    found = properties(kind)
    assert len(found) >= least
    lacking = [f"{where}.{key}" for where, key, each in found if not TEXT.fullmatch(each.get("description", ""))]
    assert lacking == []


@pytest.mark.parametrize("kind", ["config", "experiment"])
def test_units_are_those_in_the_names_of_keys(kind):
    for where, key, each in properties(kind):
        unit = TEXT.fullmatch(each["description"])["unit"]
        assert unit in (unit_of(key) or "none", "that of its key"), f"{where}.{key}"


@pytest.mark.parametrize("kind", ["config", "experiment"])
def test_examples_are_allowed_where_they_are_shown(kind):
    schema = schema_of(kind)
    jsonschema.Draft7Validator.check_schema(schema)
    for where, key, each in properties(kind):
        example = TEXT.fullmatch(each["description"])["example"]
        if "..." in example:
            continue
        tree, errors = read_tree(f"value: {example}\n".encode(), f"{where}.{key}")
        assert not errors, f"{where}.{key}: {example}"
        one = {**each, "definitions": schema["definitions"], "$schema": schema["$schema"]}
        jsonschema.Draft7Validator(one).validate(plain(tree)["value"])  # the schema itself is checked once
