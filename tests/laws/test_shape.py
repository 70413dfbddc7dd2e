"""Shape: functions have at most 60 lines and 6 positional parameters, calls at most 5 positional arguments."""

import ast
from collections import Counter
from functools import cache
from pathlib import Path

import camcomp

PACKAGE = Path(camcomp.__file__).parent
MOST_LINES, MOST_PARAMETERS, MOST_ARGUMENTS, MOST_FIELDS = 60, 6, 5, 5
COMPILERS = {"allocating", "entry", "fast", "inner", "kept", "njit", "jit"}  # kernels take arguments by position
BUILT_IN = {"print", "max", "min", "zip"}
# Rows of the tables of plug-ins, users' ones included; functions of any number of names of one kind.
BY_POSITION = {"Parameter", "at", "exactly_one", "table"}
BEFORE_KERNELS = {"look_up", "scan", "write_rows"}  # pass the arrays of a kernel on, in its order
# Compiled kernels over 60 lines: numba compiles a split kernel in more time.
LONG_KERNELS = {
    "corners", "cut_legs", "machine_step", "rounded", "scan_lines", "solve_one", "write_lines",
}  # fmt: skip
# Places that are still open, by folder: long functions, functions with many parameters, calls with many positional
# arguments, dataclasses with more than five fields that are not keyword-only. A number may only be lowered.
OPEN: dict[str, int] = {}


def _name(node):
    node = node.func if isinstance(node, ast.Call) else node
    return node.attr if isinstance(node, ast.Attribute) else getattr(node, "id", "")


def _is_kernel(function):
    return any(_name(each) in COMPILERS for each in function.decorator_list)


@cache
def _nodes():
    """Functions, classes and calls by path."""
    kinds = ast.FunctionDef | ast.ClassDef | ast.Call
    return {
        path: [node for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))) if isinstance(node, kinds)]
        for path in sorted(PACKAGE.rglob("*.py"))
    }


@cache
def _kernels():
    """Compiled functions: nodes."""
    found = []
    for path, nodes in _nodes().items():
        own = _wrapped(path)
        found += [n for n in nodes if isinstance(n, ast.FunctionDef) and (_is_kernel(n) or n.name in own)]
    return found


def _wrapped(path):
    """Names of functions that a call of a compiler wraps: `run = njit(...)(_run)` or `kept(_run)`."""
    return {
        each.id
        for node in _nodes()[path]
        if isinstance(node, ast.Call) and (_name(node) in COMPILERS or isinstance(node.func, ast.Call))
        for each in node.args
        if isinstance(each, ast.Name)
    }


def _lines(function):
    doc = ast.get_docstring(function, clean=False)
    return function.end_lineno - function.lineno + 1 - (doc.count("\n") + 1 if doc else 0)


def _parameters(function):
    given = [*function.args.posonlyargs, *function.args.args]
    return len(given) - (given[:1] != [] and given[0].arg in ("self", "cls"))


def _is_open_dataclass(node):
    made = [each for each in node.decorator_list if _name(each) == "dataclass"]
    keywords = [k.arg for each in made if isinstance(each, ast.Call) for k in each.keywords]
    fields = [each for each in node.body if isinstance(each, ast.AnnAssign) and "ClassVar" not in ast.unparse(each)]
    return bool(made) and node.name not in BY_POSITION and "kw_only" not in keywords and len(fields) > MOST_FIELDS


def _found():
    """Number of open places by folder."""
    compiled, names = set(_kernels()), {each.name for each in _kernels()}
    found = Counter()
    for path, nodes in _nodes().items():
        folder = "/".join(path.relative_to(PACKAGE).parts[:-1][:2]) or "."
        for node in nodes:
            if isinstance(node, ast.FunctionDef):
                is_verb = node.name == "command" or any(_name(each) == "option" for each in node.decorator_list)
                found[folder] += _lines(node) > MOST_LINES and node.name not in LONG_KERNELS
                found[folder] += (
                    _parameters(node) > MOST_PARAMETERS
                    and not is_verb
                    and node not in compiled
                    and node.name not in BEFORE_KERNELS
                )
            elif isinstance(node, ast.ClassDef):
                found[folder] += _is_open_dataclass(node)
            elif len(node.args) > MOST_ARGUMENTS:
                callee = _name(node)
                method = isinstance(node.func, ast.Attribute) and callee in ("join", "einsum", "format")
                found[folder] += not method and callee not in names | BUILT_IN | BY_POSITION | BEFORE_KERNELS
    return {key: count for key, count in found.items() if count}


def test_open_places_only_become_fewer():
    found = _found()
    assert {key: count for key, count in found.items() if count > OPEN.get(key, 0)} == {}


def test_the_number_of_open_places_is_stated():
    assert sum(OPEN.values()) == 0


def test_exempt_kernels_exist_and_are_long():
    assert {each.name for each in _kernels() if _lines(each) > MOST_LINES} >= LONG_KERNELS
