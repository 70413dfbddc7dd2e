"""Programs that have to be refused: each carries its rule id, and its dialect, in the first line."""

import re
from pathlib import Path

import pytest

from camcomp.gcode.interpret import read_program
from camcomp.ground.errors import ProgramError, format_error

FOLDER = Path(__file__).parent / "bad"
FILES = sorted(FOLDER.iterdir())


def announced(data):
    first = re.sub(rb"[\0\xff\xfe]", b"", data.split(b"\n")[0]).decode("ascii")
    rule, dialect = re.match(r"[(;]\s*(CC\d{3})\s*([a-z0-9]*)", first).groups()
    return rule, dialect or None


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_refused_with_rule_place_and_hint(path):
    data = path.read_bytes()
    rule, dialect = announced(data)
    with pytest.raises(ProgramError) as caught:
        read_program(data, name=path.name, dialect=dialect)
    error = caught.value
    assert error.rule == rule
    assert error.exit_code == 3
    assert error.at.file == path.name
    assert error.at.line >= 1 and error.at.column >= 1
    assert f"{path.name}:{error.at.line}:{error.at.column}: error[{rule}]" in format_error(error)


def test_every_rule_of_programs_has_a_bad_program():
    from camcomp.ground.rules import RULES

    shown = {announced(path.read_bytes())[0] for path in FILES}
    wanted = {rule for rule in RULES if rule.startswith("CC1")}
    # CC137 needs a correction to be refused, CC142, CC143 and CC147 ask for a job (tests/unit/model); CC141 is for files that have no
    # line of a program at all. CC144 and CC145 are of robot languages (tests/unit/gcode/test_krl.py), CC146 is of warnings.
    assert wanted - shown == {"CC137", "CC141", "CC142", "CC143", "CC144", "CC145", "CC146", "CC147"}
    assert len(FILES) >= 60
