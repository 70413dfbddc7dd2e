"""Input files of a report, with their fingerprints."""

from __future__ import annotations

from collections.abc import Sequence
from hashlib import sha256
from pathlib import PurePath

from camcomp.ground.records import dataclass
from camcomp.report.page import Section, Table


@dataclass(frozen=True)
class Input:
    """An input file: role, name (shown without folder), bytes."""

    role: str
    name: str
    data: bytes


def inputs_section(inputs: Sequence[Input], output: bytes | None = None) -> Section:
    """Section of the page with names and fingerprints of inputs and output."""
    rows = [
        [each.role, PurePath(each.name).name, str(len(each.data)), sha256(each.data).hexdigest()] for each in inputs
    ]
    if output is not None:
        rows.append(["corrected program", "", str(len(output)), sha256(output).hexdigest()])
    table = Table("Files and their fingerprints", ("what", "name", "bytes", "SHA-256"), rows)
    return Section(name="inputs", title="Inputs and output" if output is not None else "Inputs", tables=[table])
