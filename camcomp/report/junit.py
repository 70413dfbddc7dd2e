"""Cases as JUnit XML, the format in which CI servers count tests: one test case per file."""

from __future__ import annotations

import re
from collections.abc import Sequence
from xml.etree import ElementTree as xml

from camcomp.report.findings import Case, Finding, relative

# Characters that XML 1.0 forbids.
_FORBIDDEN = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def junit(suite: str, cases: Sequence[Case]) -> bytes:
    """JUnit XML of a test suite: a failed check is a failure, an error that stopped the work is an error."""
    failed = sum(bool(case.errors) and all(f.check for f in case.errors) for case in cases)
    broken = sum(not all(f.check for f in case.errors) for case in cases)
    # Times are zero: equal inputs give equal bytes.
    counts = {"tests": str(len(cases)), "failures": str(failed), "errors": str(broken), "skipped": "0", "time": "0"}
    root = xml.Element("testsuites", {"name": "camcomp", **counts})
    node = xml.SubElement(root, "testsuite", {"name": _clean(suite), **counts})
    for case in cases:
        name = relative(case.name) or "standard input"
        each = xml.SubElement(node, "testcase", classname=_clean(suite), name=_clean(name), time="0")
        if case.errors:
            kind = "failure" if all(f.check for f in case.errors) else "error"
            first = case.errors[0]
            told = xml.SubElement(each, kind, type=first.rule, message=_clean(first.message))
            told.text = _clean("\n".join(_line(f) for f in case.errors))
        warnings = [f for f in case.findings if f.level == "warning"]
        if case.note or warnings:
            lines = ([case.note] if case.note else []) + [_line(f) for f in warnings]
            xml.SubElement(each, "system-out").text = _clean("\n".join(lines))
    xml.indent(root)
    out: bytes = b'<?xml version="1.0" encoding="UTF-8"?>\n' + xml.tostring(root, encoding="utf-8") + b"\n"
    return out


def _line(finding: Finding) -> str:
    file = relative(finding.file) if finding.file else None
    place = f"{file}:{finding.line}:{finding.column}: " if file and finding.line else f"{file}: " if file else ""
    return f"{place}{finding.level}[{finding.rule}]: {finding.message}"


def _clean(text: str) -> str:
    return _FORBIDDEN.sub("\ufffd", text)
