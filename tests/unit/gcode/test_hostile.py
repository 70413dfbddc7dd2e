"""Damaged inputs that reach the reader: deep, long, and repetitive ones. None may take long."""

import time

import pytest

from camcomp.gcode.interpret import read_program
from camcomp.ground.errors import CamcompError, format_error
from tests.pace import soon

HOSTILE = {
    "brackets": "G0 X" + "[" * 5000,
    "signs": "G0 X" + "-" * 5000 + "1",
    "parameters of parameters": "G0 X" + "#" * 5000 + "1",
    "brackets in a setting": "#1=" + "[" * 3000 + "\nG0 X1",
    "brackets in a condition": "o1 if " + "[" * 3000 + "\nG0 X1",
    "a long sum": "G0 X[" + "+".join(["1"] * 5000) + "]",
    "functions": "G0 X" + "SIN[" * 3000,
    "a condition of a macro": "IF" + "[" * 4000,
    "round brackets": "R1=" + "(" * 4000,
    "many digits": "G0 X" + "1" * 50_000,
    "letters": "X" * 50_000,
    "slashes": "/" * 50_000,
    "line numbers": "N" * 50_000,
    "labels": "o" * 50_000 + "<" * 50_000,
    "names that do not end": "#<" * 30_000,
    "g43": "g43z" * 30_000,
    "percent": "%" * 10_000,
    "empty lines": "\n" * 50_000,
    "blanks": "G0 X1" + " " * 200_000,
    "blank lines": (" " * 2000 + "\n") * 100,
    "comments": "G0 X1 " + "(" * 5000 + ")" * 4999,
    "zero bytes": "\0" * 100_000,
}


@pytest.mark.parametrize("dialect", [None, "rs274", "fanuc", "sinumerik", "grbl"])
@pytest.mark.parametrize("name", HOSTILE)
def test_an_answer_comes_soon(name, dialect):
    begun = time.process_time()
    try:
        read_program(HOSTILE[name].encode(), name=name, dialect=dialect)
    except CamcompError as error:
        assert error.exit_code == 3
        assert error.at.line >= 1
        format_error(error)
    assert soon(time.process_time() - begun, 5.0)
