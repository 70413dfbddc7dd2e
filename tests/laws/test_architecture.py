"""Imports go one way, between folders as between files: a folder may use those below it, and nothing runs in a circle.

Shelves hold plug-ins, which nobody imports by name; camcomp/ground/shelf.py finds them.
"""

import ast
from functools import cache
from pathlib import Path

import pytest

import camcomp

PACKAGE = Path(camcomp.__file__).parent
SHELVES = {"comments", "dialects", "effects", "forces", "robots", "tool_tables"}
FLOORS = (
    {"ground"},
    {"gcode", "report"},
    {"model", "dialects", "comments"},
    {"compensation", "diagnosis", "effects", "forces", "robots", "tool_tables", "plugins"},
    {"api"},
    {"terminal"},
    {"__main__"},
)  # rooms of one floor do not import each other
LONGEST_CHAIN = 17


def room(module):
    """The top folder of a dotted module below camcomp."""
    return module.split(".")[0]


def height(module):
    """The floor of a module, counted from the ground."""
    return next(i for i, floor in enumerate(FLOORS) if room(module) in floor)


def allowed(module, other):
    """Whether `module` may import `other`."""
    if room(other) in SHELVES:
        return room(module) == room(other) and other.rsplit(".", 1)[-1].startswith("_")
    return room(module) == room(other) or height(other) < height(module)


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


@cache
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
        ("ground.files", "model.job"),
        ("gcode.words", "model.statics.solve"),
        ("model.statics.solve", "forces.none"),
        ("forces.none", "forces.constant"),
        ("forces.none", "compensation.program.compensate"),
        ("compensation.program.compensate", "forces.constant"),
        ("compensation.program.compensate", "diagnosis.diagnose"),
        ("diagnosis.diagnose", "terminal.progress"),
        ("model.effect", "diagnosis.fit.bench"),
        ("report.page", "gcode.text"),
        ("dialects.grbl", "model.control"),
    ],
)
def test_a_planted_violation_is_caught(module, other):
    assert violations({module: {other}}) == [f"{module} imports {other}"]


@pytest.mark.parametrize(
    ("module", "other"),
    [
        ("gcode.words", "gcode.text"),
        ("effects.backlash", "effects._aim"),
        ("terminal.cli", "model.config.load"),
        ("diagnosis.diagnose", "model.effect"),
    ],
)
def test_what_is_allowed_passes(module, other):
    assert violations({module: {other}}) == []


def test_a_planted_cycle_is_caught():
    assert cycle({"a": {"b"}, "b": {"c"}, "c": {"b"}}) == ["b", "c"]
    assert cycle({"a": {"b", "c"}, "b": {"c"}, "c": set()}) == []


def rooms_of(wing, edges):
    """Imports between the folders inside a wing; files that lie in the wing itself are the room above all of them."""
    out = {}
    for module, below in edges.items():
        for other in below:
            if room(module) == room(other) == wing and (own := inner(module)) != (far := inner(other)):
                out.setdefault(own, set()).add(far)
    return out


def inner(module):
    parts = module.split(".")
    return parts[1] if len(parts) > 2 else "."


@pytest.mark.parametrize("wing", sorted({each for floor in FLOORS for each in floor} - {"__main__"}))
def test_no_circle_between_the_folders_of_a_wing(wing):
    assert cycle(rooms_of(wing, graph(PACKAGE))) == []


def test_a_planted_circle_between_folders_is_caught():
    edges = {"model.a.x": {"model.b.y"}, "model.b.z": {"model.a.w"}}
    assert sorted(cycle(rooms_of("model", edges))) == ["a", "b"]


def at_import(path):
    """Like `imports`, of what runs when the module is imported."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    whole = [each for each in tree.body if isinstance(each, (ast.Import, ast.ImportFrom))]
    for node in whole:
        names = (
            [a.name for a in node.names]
            if isinstance(node, ast.Import)
            else [f"{node.module}.{a.name}" for a in node.names]
        )
        yield from (module_of(name.removeprefix("camcomp.")) for name in names if name.startswith("camcomp."))


def longest(edges):
    """The longest chain of modules that import one another."""
    known = {}

    def chain(module):
        if module not in known:
            known[module] = [module, *max((chain(other) for other in edges.get(module, ())), key=len, default=[])]
        return known[module]

    return max((chain(module) for module in edges), key=len)


def test_the_chains_of_imports_are_short():
    files = {path: ".".join(path.relative_to(PACKAGE).with_suffix("").parts) for path in PACKAGE.rglob("*.py")}
    edges = {name: set(at_import(path)) - {name} for path, name in files.items() if path.name != "__init__.py"}
    found = longest(edges)
    assert len(found) <= LONGEST_CHAIN, " -> ".join(found)


def test_the_root_holds_folders_only():
    assert sorted(path.name for path in PACKAGE.glob("*.py")) == ["__init__.py", "__main__.py"]


def test_every_folder_says_what_it_is_for():
    for path in PACKAGE.rglob("__init__.py"):
        assert ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))), path


def test_packages_hold_words_only_and_files_are_short():
    for path in PACKAGE.rglob("*.py"):
        text = path.read_text(encoding="utf-8")
        if path.name == "__init__.py" and path.parent not in (PACKAGE, PACKAGE / "plugins"):
            assert len(ast.parse(text).body) == 1, f"{path}: code in a folder's own file"
        assert text.count("\n") <= (800 if path.name == "rules.py" else 500), path  # the catalogue is a table
