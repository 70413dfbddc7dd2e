"""`python -m tests.unreached`: how much of camcomp the tests ran, and the modules of which no function ran.

Reads coverage.py's data file. Functions that numba compiles and commands that tests start as processes are not seen.
"""

import json
import sys
import tempfile
from pathlib import Path


def modules(files):
    """Modules with functions of which none ran, from the `files` of coverage.py's JSON report."""
    out = []
    for name, file in sorted(files.items()):
        functions = [each["summary"]["covered_lines"] for label, each in file["functions"].items() if label]
        if functions and not any(functions):
            out.append(name)
    return out


def main():
    """Print one line of statements and one of modules."""
    from coverage import Coverage

    coverage = Coverage()
    coverage.load()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "coverage.json"
        coverage.json_report(outfile=str(path))
        found = json.loads(path.read_text())
    totals = found["totals"]
    of = (
        "all tests" if sys.version_info >= (3, 12) else "the first test of every file of tests/unit"
    )  # see tests/conftest.py
    print(f"{of} ran {totals['percent_covered']:.1f} % of {totals['num_statements']} statements")
    print("modules that none of them reached:", ", ".join(modules(found["files"])) or "none")


if __name__ == "__main__":
    main()
