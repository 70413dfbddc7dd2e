"""Findings as SARIF 2.1.0, the format that code hosts show at the lines of a change."""

from __future__ import annotations

import json
import os
from collections import Counter
from collections.abc import Sequence
from hashlib import sha256
from typing import Any
from urllib.parse import quote

from camcomp import __version__
from camcomp.ground.errors import shown
from camcomp.ground.rules import RULES
from camcomp.report.findings import Case, Finding, relative


def sarif(cases: Sequence[Case]) -> bytes:
    """SARIF log with one run. Paths are relative to the working folder; equal findings give equal bytes."""
    found = [each for case in cases for each in case.findings]
    rules = sorted({each.rule for each in found})
    seen: Counter[str] = Counter()
    log = {
        "$schema": "https://json.schemastore.org/sarif-2.1.0.json",
        "version": "2.1.0",
        "runs": [
            {
                "tool": {
                    "driver": {
                        "name": "camcomp",
                        "version": __version__,
                        "semanticVersion": __version__,
                        "rules": [_rule(rule) for rule in rules],
                    }
                },
                "columnKind": "unicodeCodePoints",
                "results": [_result(each, rules, seen) for each in found],
            }
        ],
    }
    return (json.dumps(_shown(log), indent=1, ensure_ascii=False) + "\n").encode()


def _shown(value: Any) -> Any:
    """The value with all texts in displayable form: control characters and invalid UTF-8 as escapes."""
    if isinstance(value, str):
        return shown(value)
    if isinstance(value, dict):
        return {key: _shown(each) for key, each in value.items()}
    return [_shown(each) for each in value] if isinstance(value, list) else value


def _rule(rule: str) -> dict[str, Any]:
    told = RULES.get(rule)
    if told is None:
        return {"id": rule, "shortDescription": {"text": "a warning" if rule == "warning" else "a bug in camcomp"}}
    out: dict[str, Any] = {
        "id": rule,
        "shortDescription": {"text": told.title},
        "fullDescription": {"text": told.explanation},
    }
    return out | ({"help": {"text": told.hint}} if told.hint else {})


def _result(finding: Finding, rules: Sequence[str], seen: Counter[str]) -> dict[str, Any]:
    uri = relative(finding.file) if finding.file else None
    # A finding is identified by the text of its line, not by its number, which changes with lines inserted above.
    said = f"{finding.rule}\0{uri}\0{finding.source.strip() or finding.message}"
    seen[said] += 1
    out: dict[str, Any] = {
        "ruleId": finding.rule,
        "ruleIndex": rules.index(finding.rule),
        "level": finding.level,
        "message": {"text": finding.message},
        "partialFingerprints": {"camcomp/v1": sha256(os.fsencode(f"{said}\0{seen[said]}")).hexdigest()[:32]},
    }
    if uri is not None:
        place: dict[str, Any] = {"artifactLocation": {"uri": quote(os.fsencode(uri)), "uriBaseId": "%SRCROOT%"}}
        if finding.line:
            region: dict[str, Any] = {"startLine": finding.line}
            if finding.column:
                region["startColumn"] = finding.column
            if finding.source.strip():
                region["snippet"] = {"text": finding.source.rstrip("\r\n")}
            place["region"] = region
        out["locations"] = [{"physicalLocation": place}]
    return out
