"""The files that went into a report, with their fingerprints."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from hashlib import sha256
from pathlib import PurePath

from camcomp.report.page import Section, Table


@dataclass(frozen=True)
class Input:
    """A file that went in: what it is, its name (the page shows it without folder), its bytes."""

    role: str
    name: str
    data: bytes


def inputs_section(inputs: Sequence[Input], output: bytes | None = None) -> Section:
    """The section that tells which files were used, and what came out."""
    rows = [
        [each.role, PurePath(each.name).name, str(len(each.data)), sha256(each.data).hexdigest()] for each in inputs
    ]
    if output is not None:
        rows.append(["corrected program", "", str(len(output)), sha256(output).hexdigest()])
    table = Table("Files and their fingerprints", ("what", "name", "bytes", "SHA-256"), rows)
    return Section("inputs", "Inputs and output" if output is not None else "Inputs", tables=[table])
