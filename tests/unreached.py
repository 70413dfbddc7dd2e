"""`python -m tests.unreached [FILE ...]` runs tests (all without FILE) under coverage.py: how much of camcomp they ran, and the
modules of which no function ran.

Functions that numba compiles and commands that tests start as processes are not seen. Measuring takes more than half as long
again, so that it is no part of the plain run.
"""

import json
import os
import subprocess
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

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "coverage.json"
        os.environ["COVERAGE_FILE"] = str(Path(folder) / "coverage")
        words = [sys.executable, "-m", "pytest", "-q", "-n", "2", "--cov", "--cov-report=", *sys.argv[1:]]
        done = subprocess.run(words, check=False)
        coverage = Coverage()
        coverage.load()
        coverage.json_report(outfile=str(path))
        found = json.loads(path.read_text())
    totals = found["totals"]
    print(f"the tests ran {totals['percent_covered']:.1f} % of {totals['num_statements']} statements")
    print("modules that none of them reached:", ", ".join(modules(found["files"])) or "none")
    return done.returncode


if __name__ == "__main__":
    sys.exit(main())
