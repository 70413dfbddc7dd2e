"""Dataclasses that are defined in a third of the time: a start defines more than a hundred.

The standard decorator compiles up to six methods for every class, here all classes share them but `__init__`. Of frozen
classes only the type checker sees that they are frozen.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from functools import partial
from typing import TYPE_CHECKING, Any, Self

__all__ = ["Rows", "dataclass", "field", "fields", "replace"]

if not TYPE_CHECKING:
    _with_init = partial(dataclass, eq=False, repr=False)

    def dataclass(cls: type | None = None, /, *, frozen: bool = False, eq: bool = True, kw_only: bool = False) -> Any:
        """The standard decorator with three of its options, for classes without methods of these names."""
        if cls is None:
            return partial(dataclass, frozen=frozen, eq=eq, kw_only=kw_only)
        cls.__repr__ = _repr
        if eq:
            cls.__eq__, cls.__hash__ = _is_equal, _hash if frozen else None
        return _with_init(cls, kw_only=kw_only)


def _values(record: Any) -> tuple[Any, ...]:
    return tuple(getattr(record, each.name) for each in fields(record) if each.compare)


def _repr(record: Any) -> str:
    values = ", ".join(f"{each.name}={getattr(record, each.name)!r}" for each in fields(record) if each.repr)
    return f"{type(record).__qualname__}({values})"


def _is_equal(record: Any, other: Any) -> Any:
    return _values(record) == _values(other) if type(other) is type(record) else NotImplemented


def _hash(record: Any) -> int:
    return hash(_values(record))


@dataclass(frozen=True, eq=False)
class Rows:
    """Base of records of arrays with a row for each of the same things; records in them are Rows too, or the same for all."""

    def take(self, rows: Any) -> Self:
        """Some of the rows, by indices, mask or slice."""
        columns: dict[str, Any] = {each.name: _taken(getattr(self, each.name), rows) for each in fields(self)}
        return type(self)(**columns)

    @classmethod
    def joined(cls, parts: Sequence[Self]) -> Self:
        """The rows of several records, one behind the other."""
        names = [each.name for each in fields(cls)]
        columns: dict[str, Any] = {name: _joined([getattr(part, name) for part in parts]) for name in names}
        return cls(**columns)


def _taken(value: Any, rows: Any) -> Any:
    if isinstance(value, Rows):
        return value.take(rows)
    return value[rows] if hasattr(value, "shape") else value


def _joined(values: Sequence[Any]) -> Any:
    if isinstance(values[0], Rows):
        return type(values[0]).joined(values)
    if not hasattr(values[0], "shape"):
        return values[0]
    from numpy import concatenate  # a start without arrays does not wait for it

    return concatenate(values)
