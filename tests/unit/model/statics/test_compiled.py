"""The cache of machine code is out of date as soon as anything changes that was compiled into it."""

import re
from importlib import import_module
from pathlib import Path
from types import FunctionType, ModuleType

import pytest

import camcomp
from camcomp.ground import machine_code

PACKAGE = Path(camcomp.__file__).parent
FILES = [path for path in PACKAGE.rglob("*.py") if re.search(r"^@entry$", path.read_text(), re.MULTILINE)]


def module_of(path):
    return import_module(".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts))


def python_of(value):
    """The Python function behind a compiled one, or None."""
    value = value.py_func if hasattr(value, "py_func") else value
    if not isinstance(value, FunctionType):
        return None
    value = getattr(value, "__wrapped__", value)
    return value if value.__module__.startswith("camcomp.") else None


def compiled_into(function, seen):
    """All Python functions that a compiled function calls, itself included; constants belong to who names them."""
    if function in seen:
        return seen
    seen.add(function)
    for name in function.__code__.co_names:
        value = function.__globals__.get(name)
        assert not isinstance(value, ModuleType) or not value.__name__.startswith("camcomp"), name
        if (called := python_of(value)) is not None:
            compiled_into(called, seen)
    return seen


def test_there_are_kernels():
    assert {path.stem for path in FILES} >= {"linear_lines", "linear_rows", "kernel", "gradients", "sweep"}


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_every_function_and_constant_comes_from_a_source(path):
    sources = machine_code.sources(path)
    entries = [
        each.__wrapped__
        for each in vars(module_of(path)).values()
        if isinstance(each, FunctionType) and hasattr(each, "load")
    ]
    assert entries
    for function in set().union(*(compiled_into(each, set()) for each in entries)):
        assert Path(function.__code__.co_filename) in sources
        text = Path(function.__code__.co_filename).read_text()
        for module, names in re.findall(r"^from (camcomp\S+) import (\([^)]*\)|.*)$", text, re.MULTILINE):
            used = set(re.findall(r"\w+", names)) & set(function.__code__.co_names)
            assert not used or PACKAGE.parent.joinpath(*module.split(".")).with_suffix(".py") in sources, (module, used)


@pytest.mark.parametrize(
    "way",
    [
        "from camcomp.far import C",
        "from camcomp import far",
        "import camcomp.far",
        "from camcomp.far import (\n    C,\n)",
    ],
)
def test_what_is_behind_an_import_counts(way, tmp_path, monkeypatch):
    folder = tmp_path / "camcomp"
    folder.mkdir()
    (folder / "__init__.py").write_text("")
    (folder / "near.py").write_text("from camcomp.middle import D\n")
    (folder / "middle.py").write_text(way + "\n")
    (folder / "far.py").write_text("C = 1\n")
    monkeypatch.setattr(machine_code, "ROOT", tmp_path)

    def digest():
        for each in (machine_code._read, machine_code.sources, machine_code.digest):
            each.cache_clear()
        return machine_code.digest(folder / "near.py")

    before = digest()
    assert digest() == before
    (folder / "far.py").write_text("C = 2\n")
    assert digest() != before
