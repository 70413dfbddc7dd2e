"""The list of unreached modules holds those without a function that ran."""

from tests.unreached import modules


def file(**covered):
    return {"functions": {name.replace("module", ""): {"summary": {"covered_lines": n}} for name, n in covered.items()}}


def test_a_module_that_was_only_imported_is_not_reached():
    files = {
        "a.py": file(module=9, first=0, second=3),
        "b.py": file(module=9, first=0, second=0),
        "constants.py": file(module=4),
    }
    assert modules(files) == ["b.py"]
