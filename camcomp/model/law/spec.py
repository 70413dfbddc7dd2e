"""Laws in YAML: the keys of the effects `formula` and `map`, checked."""

from __future__ import annotations

import re
from functools import cached_property
from typing import Any, Literal

import numpy as np
from pydantic import Field, ValidationInfo, field_validator, model_validator
from pydantic_core import PydanticCustomError

from camcomp.model.config.base import Limits, Spec
from camcomp.model.law.covariates import AT_DRIVE, AT_TIP, FOLLOWED_LOADS, LOADS, is_load, load_of
from camcomp.model.law.expression import Expression, FormulaError, parse
from camcomp.model.law.law import AT_DRIVES, EmpiricalLaw
from camcomp.model.law.spline_map import DEGREE, SplineMap

MOST_COEFFICIENTS = 40  # along one covariate
_EVERY = {**AT_TIP, **AT_DRIVE, **FOLLOWED_LOADS, **LOADS}
_WORD = re.compile(r"[A-Za-z_]\w*")


def known_names(on: str, text: str = "") -> dict[str, str]:
    """Covariates of a law at a stage, with descriptions; loads of drives are those whose names occur in `text`."""
    if on == "drive":
        return {**AT_DRIVE, **LOADS, **{word: "load of a drive" for word in _WORD.findall(text) if is_load(word)}}
    return {**AT_DRIVE, **FOLLOWED_LOADS} if on in AT_DRIVES else AT_TIP


class _LawSpec(Spec):
    stage: Literal["control", "drive", "structure", "tool", "workpiece"] = Field(
        description="control and drive: shifts actuators, mm or rad; the others: shifts the tip, mm"
    )
    axis: Literal["x", "y", "z"] | None = Field(None, description="of the program, along which the tip is shifted")
    envelope: dict[str, Limits] = Field(
        default_factory=dict,
        description="where the law was seen: covariate -> [low, high]; outside it fades to nothing",
    )

    @model_validator(mode="after")
    def _fits_together(self) -> Any:
        if (self.axis is None) != (self.stage in AT_DRIVES):
            need = "has no axis; its target says which actuator" if self.axis else "needs axis: x, y or z"
            raise PydanticCustomError("CC205", f"a law on {self.stage} {need}")
        for name in self.envelope:
            self._known(name)
        return self

    def _known(self, name: str) -> None:
        if name not in known_names(self.stage, name):
            raise PydanticCustomError(
                "CC290", f"'{name}' is not known on {self.stage}; known here: {', '.join(known_names(self.stage))}"
            )

    @property
    def shape(self) -> Expression | SplineMap:
        """The function to be evaluated: a formula or a map."""
        raise NotImplementedError

    @property
    def loads_of(self) -> tuple[str, ...]:
        """Other actuators on whose loads the law depends."""
        return tuple(other for other in map(load_of, (*self.shape.names, *self.envelope)) if other is not None)

    @cached_property
    def law(self) -> EmpiricalLaw:
        """The law as hooks use it."""
        envelope = {name: (low, high) for name, (low, high) in self.envelope.items()}
        label = f"the law on {self.stage}{'' if self.axis is None else ' ' + self.axis}"
        return EmpiricalLaw(
            on=self.stage, shape=self.shape, envelope=envelope, axis="xyz".index(self.axis or "x"), label=label
        )

    def effect_values(self) -> dict[str, Any]:
        """Values for the hooks: the law."""
        return {"law": self.law}


class FormulaSpec(_LawSpec):
    """A formula over covariates whose names end in their units."""

    formula: str = Field(description="mm (rad on hinges); numbers, + - * / ^, functions and covariates of the stage")

    @field_validator("formula")
    @classmethod
    def _can_be_read(cls, text: str, info: ValidationInfo) -> str:
        try:
            parse(text, known_names(info.data["stage"], text) if "stage" in info.data else _EVERY)
        except FormulaError as error:
            hint = f" ({error.hint})" if error.hint else ""
            raise PydanticCustomError("CC290", "{text}", {"text": f"{error}{hint}", "offset": error.at}) from None
        return text

    @property
    def shape(self) -> Expression:
        """The formula."""
        return parse(self.formula, known_names(self.stage, self.formula))


class MapSpec(_LawSpec):
    """A tensor product of uniform cubic B-splines over one or two covariates."""

    over: list[str] = Field(min_length=1, max_length=2, description="covariates; the envelope names the limits of each")
    coefficients_mm: list[float] | list[list[float]] = Field(
        description="mm (rad on hinges) of the splines; a list per spline of the first covariate where there are two"
    )

    @model_validator(mode="after")
    def _is_a_grid(self) -> MapSpec:
        for name in self.over:
            self._known(name)
            if name not in self.envelope:
                raise PydanticCustomError("CC291", f"the envelope does not state '{name}'")
        lists = [isinstance(each, list) for each in self.coefficients_mm]
        if any(lists) != all(lists) or any(lists) != (len(self.over) == 2):
            raise PydanticCustomError("CC291", "coefficients_mm is one list per covariate deep")
        rows = self.coefficients_mm if any(lists) else [self.coefficients_mm]
        widths = {len(each) for each in rows if isinstance(each, list)}
        sizes = [*widths, *([len(rows)] if any(lists) else [])]
        if len(widths) != 1 or not all(DEGREE < each <= MOST_COEFFICIENTS for each in sizes):
            raise PydanticCustomError(
                "CC291",
                f"coefficients_mm has {DEGREE + 1} to {MOST_COEFFICIENTS} numbers along every covariate, as many in all rows",
            )
        return self

    @property
    def shape(self) -> SplineMap:
        """The map."""
        limits = tuple((self.envelope[name][0], self.envelope[name][1]) for name in self.over)
        return SplineMap(tuple(self.over), limits, np.array(self.coefficients_mm, float))
