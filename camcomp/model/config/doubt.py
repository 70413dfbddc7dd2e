"""A warning about a machine file, with its place."""

from __future__ import annotations

from camcomp.ground.errors import Location
from camcomp.ground.records import dataclass


@dataclass(frozen=True)
class Doubt:
    """Something that is hardly meant, and where it stands."""

    text: str
    at: Location | None

    def __str__(self) -> str:
        return f"{self.text} (line {self.at.line})" if self.at else self.text
