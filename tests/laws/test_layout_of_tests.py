"""Every folder of tests states its purpose, and modules that tests import from tests exist."""

import ast
from importlib.util import find_spec
from pathlib import Path

import pytest

TESTS = Path(__file__).parents[1]
FOLDERS = [
    each
    for each in sorted([*TESTS.iterdir(), *(TESTS / "validation").iterdir()])
    if each.is_dir() and any(each.glob("*.py"))
]


@pytest.mark.parametrize("folder", FOLDERS, ids=lambda each: each.relative_to(TESTS).as_posix())
def test_a_folder_of_tests_says_in_one_sentence_what_it_is_for(folder):
    says = ast.get_docstring(ast.parse((folder / "__init__.py").read_text(encoding="utf-8")))
    assert says and says.endswith(".") and "\n" not in says


def test_modules_that_tests_import_from_other_tests_exist():
    missing = {}
    for path in TESTS.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            module = getattr(node, "module", None) or "" if isinstance(node, ast.ImportFrom) else ""
            if module.startswith("tests.") and not _is_there(module):
                missing[module] = path.relative_to(TESTS).as_posix()
    assert missing == {}, "see tests/validation/README.md for where generators, plants and recordings are"


def _is_there(module):
    try:
        return find_spec(module) is not None
    except ModuleNotFoundError:
        return False
