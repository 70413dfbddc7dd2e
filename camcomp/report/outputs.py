"""Output files of findings, by the options of the commands."""

from __future__ import annotations

import json
from collections.abc import Sequence

from camcomp.report.findings import Case, as_json
from camcomp.report.junit import junit
from camcomp.report.sarif import sarif


def findings_files(
    verb: str, cases: Sequence[Case], *, json_file: str | None = None, sarif_file: str | None = None,
    junit_file: str | None = None,
) -> dict[str, bytes]:  # fmt: skip
    """Contents by file name, for camcomp.ground.files.write_all."""
    out: dict[str, bytes] = {}
    if json_file:
        out[json_file] = (json.dumps(as_json(cases), indent=2, ensure_ascii=False) + "\n").encode(
            "utf-8", "backslashreplace"
        )
    if sarif_file:
        out[sarif_file] = sarif(cases)
    if junit_file:
        out[junit_file] = junit(f"camcomp {verb}", cases)
    return out
