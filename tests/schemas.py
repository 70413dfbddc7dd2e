"""Results against the schemas that camcomp prints of them."""

import contextlib
import functools
import io
import json

import jsonschema

from camcomp.terminal.cli import run


@functools.cache
def validator(kind):
    """Of `camcomp schema --result KIND`."""
    out = io.StringIO()
    with contextlib.redirect_stdout(out):
        assert run(["schema", "--result", kind]) == 0
    return jsonschema.Draft7Validator(json.loads(out.getvalue()))


def check(kind, result):
    """The result of a command, as JSON has it, keeps to its schema and to the order of the schema's keys."""
    schema = validator(kind)
    schema.validate(result)
    assert list(result) == [key for key in schema.schema["properties"] if key in result]
