"""Error tables in YAML: a file, or columns in place."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from camcomp.model.config.base import Spec
from camcomp.model.error_table.table import ErrorTable, read_table, table_of

ErrorColumn = list[float] | None
_COLUMNS = ("forward_um", "reverse_um", "forward_mrad", "reverse_mrad")


class ErrorTableSpec(Spec):
    """Errors over the travel of an axis; one column of errors serves both directions."""

    file: str | None = Field(
        None, description="CSV: position_mm, and error_um or forward_um and reverse_um; or LinuxCNC's screw file"
    )
    comp_type: Literal[0, 1] | None = Field(
        None, description="COMP_FILE_TYPE of LinuxCNC, whose screw file (COMP_FILE, in mm) `file` then is"
    )
    positions_mm: ErrorColumn = Field(None, description="rising: where the scale of the axis stands")
    forward_um: ErrorColumn = Field(None, description="errors there, mm/1000; of both directions without reverse_um")
    reverse_um: ErrorColumn = Field(None, description="errors where the positions are reached in reverse")

    @model_validator(mode="after")
    def _one_table(self) -> ErrorTableSpec:
        if self.comp_type is not None and self.file is None:
            raise PydanticCustomError("CC215", "comp_type says what the file is, and there is no file")
        if self.file is not None and (self.positions_mm is not None or self._errors()):
            raise PydanticCustomError("CC215", "the table stands in a file or here, not in both")
        try:
            self.read()
        except ValueError as error:
            raise PydanticCustomError("CC205", "{text}", {"text": str(error)}) from None
        return self

    def _errors(self) -> dict[str, list[float]]:
        """The columns of errors that are given."""
        found = {name: getattr(self, name, None) for name in _COLUMNS}
        return {name: each for name, each in found.items() if each is not None}

    def read(self) -> ErrorTable | None:
        """The table; None if the YAML names neither file nor columns.

        Raises:
            ValueError, ConfigError: CC266, the table is invalid.
            FileError: CC500, the file cannot be read.
        """
        if self.file is not None:
            return read_table(self.file, self.comp_type)
        errors = self._errors()
        if self.positions_mm is None and not errors:
            return None
        unit = next((name.removeprefix("forward_") for name in errors if name.startswith("forward_")), None)
        if self.positions_mm is None or unit is None or set(errors) - {f"forward_{unit}", f"reverse_{unit}"}:
            raise ValueError("a table has positions_mm, one column forward_..., and maybe reverse_... in the same unit")
        return table_of(self.positions_mm, errors[f"forward_{unit}"], errors.get(f"reverse_{unit}"), unit)

    def effect_values(self) -> dict[str, Any]:
        """Values for the hooks: every number of the YAML, and the table."""
        numbers = self.model_dump(exclude={"source", *ErrorTableSpec.model_fields, *_COLUMNS})
        return {**numbers, "table": self.read()}


class AxisErrorSpec(ErrorTableSpec):
    """Errors over the travel of an axis that are lengths or angles."""

    forward_mrad: ErrorColumn = Field(None, description="the same of angles")
    reverse_mrad: ErrorColumn = Field(None, description="the same of angles")
