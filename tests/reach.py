"""A pytest plugin (`-p tests.reach`, beside pytest-cov): how much of camcomp a run reached, and which modules it did not.

A module is reached when a line inside one of its functions ran in a process of the test run; processes that tests start
are not looked into. Functions that numba compiles run unseen, so modules of nothing else do not count.
"""

import ast
from pathlib import Path

import camcomp

PACKAGE = Path(camcomp.__file__).parent
_COMPILED = {"inner", "entry"}


def inside_functions(text):
    """Lines of the bodies of functions that Python itself runs."""
    lines = set()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.FunctionDef):
            names = {each.id for at in node.decorator_list for each in ast.walk(at) if isinstance(each, ast.Name)}
            if not names & _COMPILED:
                lines |= {line for each in node.body for line in range(each.lineno, each.end_lineno + 1)}
    return lines


def unreached(ran):
    """Modules of camcomp in whose functions no line ran; `ran(path)` gives the lines of a file that ran."""
    out = []
    for path in sorted(PACKAGE.rglob("*.py")):
        lines = inside_functions(path.read_text(encoding="utf-8"))
        if lines and not lines & set(ran(path)):
            out.append(str(path.relative_to(PACKAGE.parent)))
    return out


def pytest_terminal_summary(terminalreporter):
    """Between the failures and pytest's last line."""
    from coverage import Coverage

    measured = Coverage(data_file=".coverage", source=[str(PACKAGE)])
    measured.load()
    counts = [measured.analysis2(str(path)) for path in PACKAGE.rglob("*.py")]
    all_lines, missing = (sum(len(each[k]) for each in counts) for k in (1, 3))
    missed = unreached(lambda path: measured.get_data().lines(str(path)) or ())
    terminalreporter.section("reached")
    terminalreporter.line(
        f"{100.0 * (1.0 - missing / all_lines):.1f} % of {all_lines} lines ran in the processes of pytest"
    )
    terminalreporter.line("modules that no test reached: " + (", ".join(missed) or "none"))
