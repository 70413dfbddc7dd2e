"""Imports go one way: doors, bulk, stories, joints, engines, ground; rooms on one floor of engines or stories keep apart.

Ground: nouns and small tools. Engines: numerics and text, each in its folder. Joints: what several stories share to
bring engines together. Stories: one verb each. Bulk: compensation of long programs, which falls back to the
story. Doors: terminal, disk, YAML, reports. Shelves: plug-ins, which use
engines and ground and which nobody imports by name; camcomp/shelf.py finds them.
"""

import ast
from pathlib import Path

import pytest

import camcomp

PACKAGE = Path(camcomp.__file__).parent
GROUND = {
    "datatypes", "diagnostics", "pathgeometry", "rules", "se3", "shelf", "spec", "specbase", "speclink", "specrobot", "yamlcheck",
    "yamltree",
}  # fmt: skip
ENGINES = {"gcode", "statics", "cutting", "gap"}
SHELVES = {"robots", "dialects", "forces", "effects"}
JOINTS = {
    "alike", "arcfit", "armposes", "bench", "candidates", "columns", "course", "exploring", "heldout", "inquiry", "intervals", "job",
    "locate", "logcheck", "moves", "noise", "planner", "posture", "remainder", "response", "reversals", "scan", "splitting", "survey", "twin",
}  # fmt: skip
STORIES = {"armstudy", "axisstudy", "compensate", "verify", "simulate", "diagnose", "stream"}
BULK = {"bulk"}
FLOORS = (GROUND, ENGINES, JOINTS, STORIES, BULK)  # and the doors above
APART = (ENGINES, STORIES)  # rooms of these floors do not import each other


def room(module):
    """The file or folder of a dotted module below camcomp."""
    return module.split(".")[0]


def height(module):
    """The floor, counted from the ground; a shelf reaches as far down as a joint."""
    if room(module) in SHELVES:
        return FLOORS.index(JOINTS)
    return next((i for i, floor in enumerate(FLOORS) if room(module) in floor), len(FLOORS))


def allowed(module, other):
    """Whether `module` may import `other`."""
    if room(other) in SHELVES:
        return room(module) == room(other) and other.rsplit(".", 1)[-1].startswith("_")
    if room(module) == room(other):
        return True
    if room(module) in SHELVES and room(other) in JOINTS:
        return False
    same_floor = any(room(module) in floor and room(other) in floor for floor in APART)
    return height(other) <= height(module) and not same_floor


def imports(path):
    """Dotted names below camcomp that a file imports, each at the module it names."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}:{node.lineno}: relative import"
            names = [f"{node.module}.{alias.name}" for alias in node.names] if node.module else []
        else:
            continue
        for name in names:
            if name.startswith("camcomp."):
                yield module_of(name.removeprefix("camcomp."))


def module_of(name):
    """The module that `a.b.c` stands for: a.b.c, or a.b when c is something in it."""
    parts = name.split(".")
    while len(parts) > 1 and not (
        PACKAGE.joinpath(*parts).with_suffix(".py").exists() or PACKAGE.joinpath(*parts).is_dir()
    ):
        parts.pop()
    return ".".join(parts)


def graph(package):
    files = [path for path in package.rglob("*.py") if path.name != "__init__.py"]
    return {".".join(path.relative_to(package).with_suffix("").parts): set(imports(path)) for path in files}


def violations(edges):
    return [
        f"{module} imports {other}"
        for module, below in sorted(edges.items())
        for other in sorted(below - {module, "__version__"})
        if not allowed(module, other)
    ]


def cycle(edges):
    """Modules of one import cycle, or none."""
    done, path = set(), []

    def visit(module):
        if module in path:
            return path[path.index(module) :]
        if module in done:
            return []
        path.append(module)
        for other in sorted(edges.get(module, ())):
            if found := visit(other):
                return found
        done.add(path.pop())
        return []

    for module in sorted(edges):
        if found := visit(module):
            return found
    return []


def test_imports_go_downwards():
    assert violations(graph(PACKAGE)) == []


def test_there_is_no_cycle():
    assert cycle(graph(PACKAGE)) == []


@pytest.mark.parametrize(
    ("module", "other"),
    [
        ("specbase", "statics.solve"),
        ("gcode.words", "statics.solve"),
        ("statics.solve", "forces.none"),
        ("forces.none", "forces.constant"),
        ("forces.none", "compensate"),
        ("compensate", "verify"),
        ("compensate", "forces.constant"),
        ("compensate", "config"),
        ("gap.effect", "config"),
        ("config", "effects.none"),
        ("job", "compensate"),
        ("effects.none", "twin"),
        ("cutting.track", "gap.effect"),
    ],
)
def test_a_planted_violation_is_caught(module, other):
    assert violations({module: {other}}) == [f"{module} imports {other}"]


@pytest.mark.parametrize(
    ("module", "other"),
    [
        ("gcode.words", "gcode.text"),
        ("effects.backlash", "effects._aim"),
        ("cli", "config"),
        ("compensate", "gap.effect"),
    ],
)
def test_what_is_allowed_passes(module, other):
    assert violations({module: {other}}) == []


def test_a_planted_cycle_is_caught():
    assert cycle({"a": {"b"}, "b": {"c"}, "c": {"b"}}) == ["b", "c"]
    assert cycle({"a": {"b", "c"}, "b": {"c"}, "c": set()}) == []


def test_packages_are_empty_and_files_short():
    for path in PACKAGE.rglob("*.py"):
        text = path.read_text(encoding="utf-8")
        if path.name == "__init__.py" and path.parent != PACKAGE:
            assert not text.strip(), path
        assert text.count("\n") <= (600 if path.name == "rules.py" else 500), path  # the catalogue is a table
