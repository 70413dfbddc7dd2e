"""Every tuned number of the diagnosis is in one table, with its decision and its source."""

import ast
from pathlib import Path

import pytest

import camcomp

PACKAGE = Path(camcomp.__file__).parent
WING = PACKAGE / "diagnosis"
TABLE = PACKAGE / "data" / "constants.md"
LONG = "as in the code"
EVERYDAY = {0.5}  # a half says itself what it is
TINY = 1e-6  # below it a number keeps from dividing by zero
DECIDING = ("answer", "arm", "axis", "experiment", "fit", "search", "statistics")


def modules():
    """Dotted name below the wing and syntax of every module."""
    for path in sorted(WING.rglob("*.py")):
        name = ".".join(path.relative_to(WING).with_suffix("").parts)
        yield name, ast.parse(path.read_text(encoding="utf-8"))


def is_number(node):
    return isinstance(node, ast.Constant) and isinstance(node.value, (int, float)) and not isinstance(node.value, bool)


def constants(name, tree):
    """Names and texts of the numbers that a module assigns at its top."""
    for node in tree.body:
        if not isinstance(node, (ast.Assign, ast.AnnAssign)) or node.value is None:
            continue
        inside = [each for each in ast.walk(node.value) if isinstance(each, ast.Constant)]
        if not any(map(is_number, inside)) or any(isinstance(each.value, str) for each in inside):
            continue
        targets = node.targets if isinstance(node, ast.Assign) else [node.target]
        names = [each.id for target in targets for each in ast.walk(target) if isinstance(each, ast.Name)]
        for i, each in enumerate(names):
            value = node.value.elts[i] if isinstance(node.value, ast.Tuple) and len(names) > 1 else node.value
            yield f"{name}.{each}", ast.unparse(value)


def compared(tree):
    """Lines that compare something with a broken number that has no name."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Compare):
            for side in (node.left, *node.comparators):
                for each in ast.walk(side):
                    broken = is_number(each) and isinstance(each.value, float) and each.value % 1 != 0
                    if broken and abs(each.value) not in EVERYDAY and abs(each.value) > TINY:
                        yield node.lineno


def table():
    """Rows of the table: constant -> cells behind it."""
    rows = {}
    for line in TABLE.read_text(encoding="utf-8").splitlines():
        if line.startswith("| `"):
            cells = [each.strip() for each in line.strip("|").split("|")]
            assert cells[0].strip("`") not in rows, cells[0]
            rows[cells[0].strip("`")] = cells[1:]
    return rows


def test_the_table_is_complete_and_true():
    code = dict(each for name, tree in modules() for each in constants(name, tree))
    stated = {name: cells[0].strip("`") for name, cells in table().items()}
    assert stated == {name: value if len(value) < 60 else LONG for name, value in code.items()}


def test_every_constant_says_what_it_decides_and_where_it_comes_from():
    assert [name for name, (_, decides, source, *_) in table().items() if not decides or not source] == []


def test_no_threshold_is_written_into_a_comparison():
    found = [f"{n}:{k}" for n, tree in modules() if n.split(".")[0] in DECIDING for k in compared(tree)]
    assert found == []


@pytest.mark.parametrize("text", ["if x > 0.02: pass", "y = a < 12.5 * b", "z = [i for i in n if 0.1 < i]"])
def test_a_planted_threshold_is_caught(text):
    assert list(compared(ast.parse(text)))


def test_a_planted_constant_is_caught():
    assert dict(constants("m", ast.parse("A, B = 1.0, 2\nC: int = 3\nD = 'no'"))) == {
        "m.A": "1.0",
        "m.B": "2",
        "m.C": "3",
    }
