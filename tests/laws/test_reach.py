"""The list of modules that no test reaches says what it says."""

import pytest

from tests import reach


def test_lines_of_functions_that_python_runs():
    text = "import a\n\n\n@inner\ndef f(x):\n    return x\n\n\ndef g(x):\n    y = x\n    return y\n\n\nclass C:\n    def h(self):\n        pass\n"
    assert reach.inside_functions(text) == {10, 11, 16}


@pytest.mark.parametrize(
    ("room", "reached"), [("ground", ["shelf.py"]), ("dialects", []), ("model/statics", ["solve.py"])]
)
def test_a_module_is_reached_by_a_line_inside_a_function(room, reached, monkeypatch):
    monkeypatch.setattr(reach, "PACKAGE", reach.PACKAGE / room)
    assert reach.unreached(lambda path: range(1, 10_000)) == []
    missed = reach.unreached(lambda path: ())
    assert {f"{room.split('/')[-1]}/{each}" for each in reached} <= set(missed)
    assert not {"statics/vectors.py", "dialects/grbl.py"} & set(missed), "there is nothing to reach in these"
