"""Findings per file for the machine-readable reports."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path, PurePath
from typing import Any

from camcomp.ground.errors import CamcompError, CheckFailed
from camcomp.ground.places import STANDARD
from camcomp.ground.records import dataclass, field

WARNING = "warning"  # rule of all warnings, which have no ids of their own


@dataclass(frozen=True, kw_only=True)
class Finding:
    """One message about one location. line and column count from 1; 0: the whole file; file None: no file."""

    rule: str
    message: str
    file: str | None = None
    line: int = 0
    column: int = 0
    source: str = ""
    check: bool = False  # the work was finished, and a check failed

    @property
    def level(self) -> str:
        """`error` or `warning`."""
        return WARNING if self.rule == WARNING else "error"


@dataclass(frozen=True)
class Case:
    """One checked file. note: its kind if it has no errors."""

    name: str
    findings: Sequence[Finding] = field(default_factory=tuple)
    note: str = ""

    @property
    def errors(self) -> list[Finding]:
        """Findings that are more than warnings."""
        return [each for each in self.findings if each.level == "error"]


def findings_of(error: CamcompError, file: str | None = None) -> list[Finding]:
    """Findings of an error and of those raised with it; those without a location belong to `file`."""
    out = []
    for each in error.all():
        check = isinstance(each, CheckFailed)
        if each.at:
            at = each.at
            out.append(
                Finding(
                    rule=each.rule,
                    message=each.message,
                    file=at.file,
                    line=at.line,
                    column=at.column,
                    source=at.source,
                    check=check,
                )
            )
        else:
            out.append(Finding(rule=each.rule, message=each.message, file=file, check=check))
    return out


def findings_of_messages(messages: Sequence[Mapping[str, Any]], file: str, *, check: bool) -> list[Finding]:
    """Findings of one program of a batch from its messages; check: its outputs are written, and a check failed."""
    return [
        Finding(
            rule=each.get("rule") or "CC-BUG",
            message=each["message"],
            file=file,
            line=int(each.get("line") or 0),
            column=int(each.get("column") or 0),
            check=check,
        )
        for each in messages
    ]


def as_json(cases: Sequence[Case]) -> dict[str, Any]:
    """Cases as a mapping for JSON."""
    return {
        "ok": not any(case.errors for case in cases),
        "files": [
            {
                "file": case.name,
                "ok": not case.errors,
                "note": case.note,
                "findings": [
                    {"rule": f.rule, "level": f.level, "message": f.message, "file": f.file, "line": f.line or None,
                     "column": f.column or None}
                    for f in case.findings
                ],
            }
            for case in cases
        ],
    }  # fmt: skip


def relative(file: str) -> str | None:
    """The file seen from the working folder, with / between folders; None for standard input."""
    if file in (STANDARD, "<stdin>"):
        return None
    try:
        return PurePath(os.path.relpath(file)).as_posix()
    except ValueError:  # another drive
        return Path(os.path.realpath(file)).as_posix()
