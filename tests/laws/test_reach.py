"""The list of modules that no test reached says what it says."""

import builtins

import pytest

from tests import reach

TEXT = '''
import a


@inner
def compiled(x):
    return x


def f(x):
    """What it does."""
    if x > 0:
        y = 1
        return y
    for _ in range(0):
        x = 2
    try:
        x = 1 / 0
    except ZeroDivisionError:
        x = 3

    def g():
        return x

    return -x


class C:
    def h(self):
        pass
'''

FIRST = 3  # marks of modules that were imported before


def ran(call):
    """Lines of the marks that a call leaves."""
    tree, runs = reach.marked(TEXT.replace("import a", "inner = lambda function: function"), FIRST)
    met = [False] * (FIRST + len(runs))
    names = {reach.RAN: met}
    exec(compile(tree, "f.py", "exec"), names)  # noqa: S102 - the text above
    assert names["f"].__doc__ == "What it does."
    call(names)
    assert not any(met[:FIRST]), "those are another module's"
    return sorted(line for line, was in zip(runs, met[FIRST:], strict=True) if was), runs


def test_a_run_of_statements_is_marked_once_it_has_begun():
    lines, runs = ran(lambda names: names["f"](1))
    assert lines == [12, 13]
    assert sum(runs.values()) == 12, (
        "what numba compiles, imports, classes and docstrings are no statements of a function"
    )


def test_what_comes_after_a_branch_has_a_mark_of_its_own():
    lines, runs = ran(lambda names: names["f"](-1))
    assert lines == [12, 15, 17, 18, 20, 22]
    assert {line: runs[line] for line in lines} == {12: 1, 15: 1, 17: 1, 18: 1, 20: 1, 22: 2}


def test_marks_that_were_met_are_taken_out_and_the_others_stay(monkeypatch):
    text = TEXT.replace("import a", "inner = lambda function: function")
    tree, runs = reach.marked(text, FIRST)
    code = compile(tree, "f.py", "exec")
    met = [False] * (FIRST + len(runs))
    monkeypatch.setattr(builtins, reach.RAN, met, raising=False)
    monkeypatch.setattr(reach, "LOADED", [("f.py", text, FIRST, code)])
    monkeypatch.setattr(reach, "OLD", [])
    names = {}
    exec(code, names)  # noqa: S102 - the text above
    f = names["f"]
    for argument, answer, lines in ((1, 1, [12, 13]), (-1, -3, [12, 13, 15, 17, 18, 20, 22])):
        assert f(argument) == answer
        assert [line for line, was in zip(runs, met[FIRST:], strict=True) if was] == lines
        reach.thin()
    met[:] = [False] * len(met)
    f(1), f(-1)
    assert not any(met)
    names["C"]().h()
    assert sum(met) == 1


def test_calling_what_is_compiled_leaves_no_mark():
    assert ran(lambda names: names["compiled"](1))[0] == []


@pytest.mark.parametrize(
    ("room", "module"), [("ground", "shelf.py"), ("dialects", None), ("model/statics", "solve.py")]
)
def test_a_module_is_reached_by_a_statement_inside_a_function(room, module, monkeypatch):
    monkeypatch.setattr(reach, "PACKAGE", reach.PACKAGE / room)
    everything = {
        (str(path), line)
        for path in reach.PACKAGE.rglob("*.py")
        for line in reach.marked(path.read_text(encoding="utf-8"))[1]
    }
    statements, met, missed = reach.reached(everything)
    assert (met, missed) == (statements, [])
    _, met, missed = reach.reached(set())
    assert met == 0
    assert module is None or f"{room.split('/')[-1]}/{module}" in missed
    assert not {"statics/vectors.py", "dialects/grbl.py"} & set(missed), "there is nothing to reach in these"
