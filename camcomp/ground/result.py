"""Base of the results of commands: frozen types, and their conversion to JSON."""

from __future__ import annotations

import json
from math import isfinite
from typing import Annotated, Any, ClassVar

from pydantic import AllowInfNan, BaseModel, ConfigDict, PlainSerializer


def _finite(value: float) -> float | None:
    return value if isfinite(value) else None


Size = Annotated[float, AllowInfNan(True), PlainSerializer(_finite, when_used="json")]  # null where it is not finite


class Result(BaseModel):
    """Base of every part of a result: no other keys, finite numbers, keys in the order of the fields."""

    model_config = ConfigDict(
        extra="forbid",
        frozen=True,
        allow_inf_nan=False,
        json_schema_serialization_defaults_required=True,
        defer_build=True,
    )

    INDENT: ClassVar[int] = 2

    def as_json(self) -> dict[str, Any]:
        """The result as a mapping of JSON types."""
        return self.model_dump(mode="json")

    def to_json(self) -> bytes:
        """The result as the bytes of a JSON file."""
        return (json.dumps(self.as_json(), indent=self.INDENT, allow_nan=False) + "\n").encode()
