"""A pytest plugin (`-p tests.reach`): how much of camcomp the tests ran, and which modules none of them reached.

Every run of statements inside a function is given a mark as its module is imported: an item of a list that is set, which
is the least that Python can do; a tracer doubles the time of the tests. Still they take a tenth of it, so that functions
lose the marks that were met now and then. What tests start as processes of their own is not looked into, and functions that
numba compiles run unseen: neither counts.
"""

import ast
import builtins
import gc
import sys
import time
from importlib.machinery import PathFinder, SourceFileLoader
from importlib.util import find_spec
from pathlib import Path
from types import CodeType, FunctionType

import pytest

PACKAGE = Path(find_spec("camcomp").origin).parent
RAN = "__camcomp_ran__"  # looked up among the builtins, so that modules need not import it: whether each mark was met
MARKS = "__camcomp_marks__"  # (path, line) of each
LOADED, OLD = [], []  # path, text, first mark and code of every module; codes that they had before
THINNED_S = [15.0, 45.0, 120.0]  # of a processor, after which that is done
_COMPILED = {"inner", "entry", "kept", "fast", "njit"}
_COMPOUND = (ast.If, ast.For, ast.While, ast.Try, ast.With, ast.Match)


class Marker(ast.NodeTransformer):
    """Puts `__camcomp_ran__[mark] = True` before every run of statements of a function; `runs` counts them by line.

    Marks are numbered from `first` on as the lines stand in `runs`; those in `met` are left out.
    """

    def __init__(self, first, met):
        self.first, self.met, self.runs = first, met, {}

    def visit_FunctionDef(self, node):
        names = {each.id for at in node.decorator_list for each in ast.walk(at) if isinstance(each, ast.Name)}
        if not names & _COMPILED:
            node.body = self.marked(node.body)
        return node

    def marked(self, block):
        """The statements of a block with marks at its start and after each statement that branches."""
        first = block[0]
        told = (
            isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant) and isinstance(first.value.value, str)
        )
        out, line = block[:told], None
        for statement in block[told:]:
            if line is None:
                line = statement.lineno
                self.runs.setdefault(line, 0)
                if (mark := self.first + list(self.runs).index(line)) not in self.met:
                    out.append(ast.copy_location(ast.parse(f"{RAN}[{mark}] = True").body[0], statement))
            self.runs[line] += 1
            out.append(self.inside(statement))
            if isinstance(statement, _COMPOUND):
                line = None
        return out

    def inside(self, statement):
        for part in (statement, *getattr(statement, "handlers", ()), *getattr(statement, "cases", ())):
            if isinstance(part, ast.FunctionDef | ast.ClassDef):
                return self.visit(part)
            for name in ("body", "orelse", "finalbody"):
                if getattr(part, name, None):
                    setattr(part, name, self.marked(getattr(part, name)))
        return statement


def marked(text, first=0, met=()):
    """Syntax tree of a module with its marks, without those met, and how many statements stand behind each of them, by line."""
    marker = Marker(first, met)
    tree = marker.visit(ast.parse(text))
    return ast.fix_missing_locations(tree), marker.runs


def reached(ran):
    """Statements in functions of camcomp, how many of them ran, and the modules in which none did."""
    statements, met, missed = 0, 0, []
    for path in sorted(PACKAGE.rglob("*.py")):
        _, runs = marked(path.read_text(encoding="utf-8"))
        here = sum(number for line, number in runs.items() if (str(path), line) in ran)
        statements, met = statements + sum(runs.values()), met + here
        if runs and not here:
            missed.append(path.relative_to(PACKAGE.parent).as_posix())
    return statements, met, missed


class Loader(SourceFileLoader):
    """Compiles modules with marks; nothing of it is kept on disk."""

    def get_code(self, fullname):
        met, marks = getattr(builtins, RAN), getattr(builtins, MARKS)
        text, first = self.get_data(self.path).decode(), len(met)
        tree, runs = marked(text, first)
        met.extend([False] * len(runs))
        marks.extend((self.path, line) for line in runs)
        code = compile(tree, self.path, "exec", dont_inherit=True)
        LOADED.append((self.path, text, first, code))
        return code


def thin():
    """Gives functions code without the marks that were met: these have told what they know."""
    met = {number for number, yes in enumerate(getattr(builtins, RAN)) if yes}
    instead = {}
    for place, (path, text, first, code) in enumerate(LOADED):
        thinner = compile(marked(text, first, met)[0], path, "exec", dont_inherit=True)
        instead.update((id(old), new) for old, new in pairs(code, thinner) if RAN in old.co_names)
        OLD.append(code)  # so that no other one is taken for it
        LOADED[place] = path, text, first, thinner
    for each in gc.get_objects():
        if type(each) is FunctionType and (code := instead.get(id(each.__code__))):
            each.__code__ = code


def pairs(old, new):
    """Codes of the same functions in two codes of a module."""
    yield old, new
    inside = [[each for each in code.co_consts if isinstance(each, CodeType)] for code in (old, new)]
    for two in zip(*inside, strict=True):
        yield from pairs(*two)


class Finder(PathFinder):
    """Finds modules of camcomp as Python does and gives them the loader above."""

    @classmethod
    def find_spec(cls, fullname, path=None, target=None):
        spec = super().find_spec(fullname, path, target) if fullname.split(".")[0] == "camcomp" else None
        if spec is not None and isinstance(spec.loader, SourceFileLoader):
            spec.loader = Loader(spec.loader.name, spec.loader.path)
        return spec


def pytest_configure(config):
    if hasattr(builtins, RAN):
        return
    setattr(builtins, RAN, [])
    setattr(builtins, MARKS, [])
    sys.meta_path.insert(0, Finder)


def pytest_runtest_teardown():
    if LOADED and THINNED_S and time.process_time() > THINNED_S[0]:
        THINNED_S.pop(0)
        thin()


def ran():
    """(path, line) of all marks that were met."""
    return {mark for mark, met in zip(getattr(builtins, MARKS), getattr(builtins, RAN), strict=True) if met}


def pytest_sessionfinish(session):
    if hasattr(session.config, "workeroutput"):
        session.config.workeroutput[RAN] = sorted(ran())


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node):
    """What a worker of pytest-xdist ran."""
    of_worker = [tuple(mark) for mark in getattr(node, "workeroutput", {}).get(RAN, ())]
    getattr(builtins, MARKS).extend(of_worker)
    getattr(builtins, RAN).extend([True] * len(of_worker))


def pytest_terminal_summary(terminalreporter):
    """Between the failures and pytest's last line."""
    statements, met, missed = reached(ran())
    terminalreporter.section("reached")
    terminalreporter.line(f"{100.0 * met / statements:.1f} % of {statements} statements ran in the processes of pytest")
    terminalreporter.line("modules that no test reached: " + (", ".join(missed) or "none"))
