"""Base of all YAML specs: no unknown keys, no silent conversions, finite numbers, positions for error messages.

A value that fails a check of our own raises PydanticCustomError with a rule id as its type; config.py turns it into an
error with file, line and column.
"""

from collections.abc import Callable
from math import isfinite
from typing import Annotated, Any, Literal, get_args

import numpy as np
from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    PlainValidator,
    ValidationInfo,
    WithJsonSchema,
    model_validator,
)
from pydantic_core import PydanticCustomError

from camcomp.ground.bounds import SMALLEST_NUMBER


class Spec(BaseModel):
    """Base of every YAML mapping. `source` says where its values come from."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False, defer_build=True)

    source: str | None = Field(
        None, description="where the values of this mapping come from", examples=["data sheet of the maker"]
    )

    @model_validator(mode="before")
    @classmethod
    def _note_spec(cls, data: Any, info: ValidationInfo) -> Any:
        # Hints for misspelt keys need the spec of a mapping, which pydantic does not report.
        if info.context is not None:
            info.context[id(data)] = cls
        return data

    @classmethod
    def yaml_keys(cls) -> list[str]:
        """The YAML keys of this spec."""
        return [field.alias or name for name, field in cls.model_fields.items()]


def zero(description: str) -> Any:
    """A field of three zeros, with its meaning."""
    return Field(default_factory=lambda: [0.0, 0.0, 0.0], description=description)


def exactly_one(spec: Spec, *names: str) -> None:
    """Raise CC215 unless exactly one of the fields `names` is given."""
    given = [name for name in names if getattr(spec, name) is not None]
    if len(given) != 1:
        fields = type(spec).model_fields
        text = ", ".join(fields[name].alias or name for name in names)
        raise PydanticCustomError("CC215", f"needs exactly one of {text}; {len(given)} are given")


def _not_tiny(value: float) -> float:
    if 0.0 < value < SMALLEST_NUMBER:
        raise PydanticCustomError(
            "CC205", f"{value:g} is smaller than {SMALLEST_NUMBER:g}; nothing can be divided by it"
        )
    return value


def _limits(pair: list[float]) -> list[float]:
    if len(pair) != 2 or not pair[0] < pair[1]:
        raise PydanticCustomError("CC209", f"limits have to be [low, high] with low < high, not {pair}")
    return pair


def _matrix(kind: str, zero_is_rigid: bool) -> Callable[[list[list[float]]], list[list[float]]]:
    def check(rows: list[list[float]]) -> list[list[float]]:
        def refuse(why: str) -> PydanticCustomError:
            return PydanticCustomError("CC208", f"{kind} matrix {why}")

        if len(rows) != 6 or any(len(row) != 6 for row in rows):
            raise refuse(
                f"needs 6 rows of 6 numbers, not rows of {', '.join(str(len(row)) for row in rows) or 'nothing'}"
            )
        m = np.array(rows)
        elastic = np.abs(m).max(axis=0) + np.abs(m).max(axis=1) > 0
        if not zero_is_rigid and not elastic.all():
            raise refuse(f"is not positive definite: row {int(np.argmin(elastic)) + 1} is zero")
        m = m[np.ix_(elastic, elastic)]
        number = np.flatnonzero(elastic) + 1
        if (np.diag(m) <= 0).any():
            raise refuse(
                f"is not positive definite: element {number[np.argmin(np.diag(m))]} of the diagonal is not > 0"
            )
        if (np.diag(m) < SMALLEST_NUMBER).any():
            raise refuse(f"has an element of the diagonal below {SMALLEST_NUMBER:g}; nothing can be divided by it")
        # mm and rad differ by orders of magnitude: symmetry and definiteness are judged on the unit-free matrix.
        scale = np.sqrt(np.diag(m))
        m = m / np.outer(scale, scale)
        difference = np.abs(m - m.T)
        if difference.size and difference.max() > 1e-9:
            i, j = sorted(number[k] for k in np.unravel_index(difference.argmax(), m.shape))
            raise refuse(f"is not symmetric: element ({i}, {j}) differs from ({j}, {i})")
        if m.size and np.linalg.eigvalsh(m)[0] < 1e-9:
            raise refuse("is not positive definite: it gives way without storing energy in some direction")
        return rows

    return check


_SIX = {"type": "array", "minItems": 6, "maxItems": 6}
_MATRIX_SCHEMA = WithJsonSchema({**_SIX, "items": {**_SIX, "items": {"type": "number"}}})

Positive = Annotated[float, Field(gt=0), AfterValidator(_not_tiny)]
NotNegative = Annotated[float, Field(ge=0), AfterValidator(_not_tiny)]
Name = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_]*$")]  # becomes part of CSV column names
Vector = Annotated[list[float], Field(min_length=3, max_length=3)]
PositiveVector = Annotated[list[Positive], Field(min_length=3, max_length=3)]
NotNegativeVector = Annotated[list[NotNegative], Field(min_length=3, max_length=3)]
Limits = Annotated[
    list[float],
    AfterValidator(_limits),
    WithJsonSchema({"type": "array", "items": {"type": "number"}, "minItems": 2, "maxItems": 2}),
]
ComplianceMatrix = Annotated[list[list[float]], AfterValidator(_matrix("compliance", True)), _MATRIX_SCHEMA]
StiffnessMatrix = Annotated[list[list[float]], AfterValidator(_matrix("stiffness", False)), _MATRIX_SCHEMA]

AxisLetter = Literal["x", "y", "z", "-x", "-y", "-z"]


def _axis(value: Any) -> str | list[float]:
    if value in get_args(AxisLetter):
        out: str | list[float] = value
        return out
    numbers = isinstance(value, list) and all(type(each) in (int, float) and isfinite(each) for each in value)
    if not numbers or len(value) != 3 or not any(value):
        raise PydanticCustomError("CC205", "an axis is one of x, y, z, -x, -y, -z, or three numbers, not all zero")
    axis: str | list[float] = value
    return axis


_NUMBER_ARRAY = {"type": "array", "items": {"type": "number"}, "minItems": 3, "maxItems": 3}
Axis = Annotated[
    str | list[float],
    PlainValidator(_axis),
    WithJsonSchema({"anyOf": [{"enum": list(get_args(AxisLetter))}, _NUMBER_ARRAY]}),
]
