"""YAML specs of elastic links: cross-sections, beams, 6-dof springs. mm, N, rad."""

from math import pi
from typing import Annotated, Literal

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from camcomp.model.config.base import (
    ComplianceMatrix,
    NotNegativeVector,
    Positive,
    PositiveVector,
    Spec,
    StiffnessMatrix,
    exactly_one,
)


class Explicit(Spec):
    """Cross-section by its numbers; y and z are the local axes across the beam."""

    type: Literal["explicit"]
    area_mm2: Positive = Field(description="area of the section")
    Iy_mm4: Positive = Field(description="second moment of area about the local y axis")
    Iz_mm4: Positive = Field(description="second moment of area about the local z axis")
    J_mm4: Positive = Field(description="torsion constant")

    def moments(self) -> tuple[float, float, float, float]:
        """Area mm2, Iy mm4, Iz mm4, torsion constant J mm4."""
        return self.area_mm2, self.Iy_mm4, self.Iz_mm4, self.J_mm4


class Square(Spec):
    """Solid square."""

    type: Literal["square"]
    side_mm: Positive = Field(description="side of the square")

    def moments(self) -> tuple[float, float, float, float]:
        """Area mm2, Iy mm4, Iz mm4, J mm4 (J = 0.141 a^4, Saint-Venant)."""
        a = self.side_mm
        return a**2, a**4 / 12, a**4 / 12, 0.141 * a**4


class Rectangle(Spec):
    """Solid rectangle: width along local y, height along local z."""

    type: Literal["rectangle"]
    width_mm: Positive = Field(description="along the local y axis")
    height_mm: Positive = Field(description="along the local z axis")

    def moments(self) -> tuple[float, float, float, float]:
        """Area mm2, Iy mm4, Iz mm4, J mm4 (J within 0.2 % of Saint-Venant's series, a >= b)."""
        w, h = self.width_mm, self.height_mm
        b, a = sorted((w, h))
        torsion = a * b**3 * (1 / 3 - 0.21 * b / a * (1 - b**4 / (12 * a**4)))
        return w * h, w * h**3 / 12, h * w**3 / 12, torsion


class Round(Spec):
    """Solid circle."""

    type: Literal["round"]
    diameter_mm: Positive = Field(description="diameter of the bar")

    def moments(self) -> tuple[float, float, float, float]:
        """Area mm2, Iy mm4, Iz mm4, J mm4."""
        d = self.diameter_mm
        return pi * d**2 / 4, pi * d**4 / 64, pi * d**4 / 64, pi * d**4 / 32


class Tube(Spec):
    """Round tube."""

    type: Literal["tube"]
    outer_diameter_mm: Positive = Field(description="outer diameter")
    inner_diameter_mm: Positive = Field(description="inner diameter, below the outer one")

    @model_validator(mode="after")
    def _hollow(self) -> "Tube":
        if self.inner_diameter_mm >= self.outer_diameter_mm:
            raise PydanticCustomError("CC205", "inner_diameter_mm has to be smaller than outer_diameter_mm")
        return self

    def moments(self) -> tuple[float, float, float, float]:
        """Area mm2, Iy mm4, Iz mm4, J mm4."""
        o, i = self.outer_diameter_mm, self.inner_diameter_mm
        inertia = pi * (o**4 - i**4) / 64
        return pi * (o**2 - i**2) / 4, inertia, inertia, 2 * inertia


Section = Annotated[Explicit | Square | Rectangle | Round | Tube, Field(discriminator="type")]


class Beam(Spec):
    """Euler-Bernoulli cantilever along local x: the spring only; its length as an offset is a transform element."""

    length_mm: Positive = Field(description="length of the cantilever")
    E_N_per_mm2: Positive = Field(description="modulus of elasticity")
    nu: Annotated[float, Field(gt=-1, lt=0.5)] | None = Field(
        None, description="Poisson's ratio; in place of G_N_per_mm2"
    )
    G_N_per_mm2: Positive | None = Field(None, description="shear modulus; in place of nu")
    section: Section = Field(description="cross-section by its shape or its numbers")

    @model_validator(mode="after")
    def _shear(self) -> "Beam":
        exactly_one(self, "nu", "G_N_per_mm2")
        return self

    @property
    def shear_modulus(self) -> float:
        """G in N/mm2, given or E / (2 (1 + nu))."""
        return self.G_N_per_mm2 if self.nu is None else self.E_N_per_mm2 / (2 * (1 + self.nu))  # type: ignore[return-value]


class ComplianceDiagonal(Spec):
    """Diagonal of a compliance; 0 = rigid in that direction."""

    translation_mm_per_N: NotNegativeVector = Field(
        description="deflection per force along the local x, y, z; 0: rigid"
    )
    rotation_rad_per_Nmm: NotNegativeVector = Field(description="turn per moment about the local x, y, z; 0: rigid")


class StiffnessDiagonal(Spec):
    """Diagonal of a stiffness."""

    translation_N_per_mm: PositiveVector = Field(description="force per deflection along the local x, y, z")
    rotation_Nmm_per_rad: PositiveVector = Field(description="moment per turn about the local x, y, z")


class Spring(Spec):
    """A 6-dof spring (translations, then rotations, in local axes) in exactly one of five notations."""

    compliance: ComplianceMatrix | None = Field(
        None,
        alias="compliance_mm_N_rad",
        description="6x6 in mm/N, 1/N, rad/(N mm); zero row and column = rigid",
    )
    stiffness: StiffnessMatrix | None = Field(
        None, alias="stiffness_mm_N_rad", description="6x6 in N/mm, N/rad, N mm/rad"
    )
    compliance_diagonal: ComplianceDiagonal | None = Field(
        None, description="compliance without coupling between directions"
    )
    stiffness_diagonal: StiffnessDiagonal | None = Field(
        None, description="stiffness without coupling between directions"
    )
    beam: Beam | None = Field(None, description="spring of a cantilever of this size")

    @model_validator(mode="after")
    def _one_notation(self) -> "Spring":
        exactly_one(self, "compliance", "stiffness", "compliance_diagonal", "stiffness_diagonal", "beam")
        return self
