"""YAML specs of a robot: chains of elements from the base to the platform. mm, N, rad; degrees only in `_deg` keys.

Elements stand in chain order and in the local frame left by the elements before them. Joints offer `stiffness`, `home`,
`limits`, `rest`, `start` in mm or rad whatever their kind, so that nobody else needs to look at the unit of a key.
"""

from math import pi, radians
from typing import Annotated, ClassVar, Literal

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from camcomp.specbase import (
    Axis,
    AxisLetter,
    ComplianceMatrix,
    Limits,
    Name,
    NotNegativeVector,
    Positive,
    PositiveVector,
    Spec,
    StiffnessMatrix,
    Vector,
    Zero,
    exactly_one,
)

# ---------------------------------------------------------------------------------------------------------------------
# springs of links


class Explicit(Spec):
    """Cross-section by its numbers; y and z are the local axes across the beam."""

    type: Literal["explicit"]
    area_mm2: Positive
    Iy_mm4: Positive
    Iz_mm4: Positive
    J_mm4: Positive

    def moments(self) -> tuple[float, float, float, float]:
        """Area mm2, Iy mm4, Iz mm4, torsion constant J mm4."""
        return self.area_mm2, self.Iy_mm4, self.Iz_mm4, self.J_mm4


class Square(Spec):
    """Solid square."""

    type: Literal["square"]
    side_mm: Positive

    def moments(self) -> tuple[float, float, float, float]:
        """Area mm2, Iy mm4, Iz mm4, J mm4 (J = 0.141 a^4, Saint-Venant)."""
        a = self.side_mm
        return a**2, a**4 / 12, a**4 / 12, 0.141 * a**4


class Rectangle(Spec):
    """Solid rectangle: width along local y, height along local z."""

    type: Literal["rectangle"]
    width_mm: Positive
    height_mm: Positive

    def moments(self) -> tuple[float, float, float, float]:
        """Area mm2, Iy mm4, Iz mm4, J mm4 (J within 0.2 % of Saint-Venant's series, a >= b)."""
        w, h = self.width_mm, self.height_mm
        b, a = sorted((w, h))
        torsion = a * b**3 * (1 / 3 - 0.21 * b / a * (1 - b**4 / (12 * a**4)))
        return w * h, w * h**3 / 12, h * w**3 / 12, torsion


class Round(Spec):
    """Solid circle."""

    type: Literal["round"]
    diameter_mm: Positive

    def moments(self) -> tuple[float, float, float, float]:
        """Area mm2, Iy mm4, Iz mm4, J mm4."""
        d = self.diameter_mm
        return pi * d**2 / 4, pi * d**4 / 64, pi * d**4 / 64, pi * d**4 / 32


class Tube(Spec):
    """Round tube."""

    type: Literal["tube"]
    outer_diameter_mm: Positive
    inner_diameter_mm: Positive

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

    length_mm: Positive
    E_N_per_mm2: Positive
    nu: Annotated[float, Field(gt=-1, lt=0.5)] | None = None
    G_N_per_mm2: Positive | None = None
    section: Section

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

    translation_mm_per_N: NotNegativeVector
    rotation_rad_per_Nmm: NotNegativeVector


class StiffnessDiagonal(Spec):
    """Diagonal of a stiffness."""

    translation_N_per_mm: PositiveVector
    rotation_Nmm_per_rad: PositiveVector


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
    compliance_diagonal: ComplianceDiagonal | None = None
    stiffness_diagonal: StiffnessDiagonal | None = None
    beam: Beam | None = None

    @model_validator(mode="after")
    def _one_notation(self) -> "Spring":
        exactly_one(self, "compliance", "stiffness", "compliance_diagonal", "stiffness_diagonal", "beam")
        return self


# ---------------------------------------------------------------------------------------------------------------------
# elements


class Transform(Spec):
    """A rigid step: first the translation, then the rotation (rotation vector), both in the frame before it."""

    type: Literal["transform"]
    translation_mm: Vector = Zero
    rotation_deg: Vector = Zero


class _Prismatic(Spec):
    joint: Literal["prismatic"]
    axis: Axis
    stiffness_N_per_mm: Positive | None = None
    rotary: ClassVar[bool] = False

    @property
    def stiffness(self) -> float | None:
        """N/mm; None = rigid drive, or free passive joint."""
        return self.stiffness_N_per_mm


class _Revolute(Spec):
    joint: Literal["revolute"]
    axis: Axis
    stiffness_Nmm_per_rad: Positive | None = None
    rotary: ClassVar[bool] = True

    @property
    def stiffness(self) -> float | None:
        """N mm/rad; None = rigid drive, or free passive joint."""
        return self.stiffness_Nmm_per_rad


class PrismaticActuator(_Prismatic):
    """Driven slide; without a stiffness its drive is rigid."""

    type: Literal["actuator"]
    name: Name | None = Field(None, description="default: the name of the chain")
    home_mm: float = 0.0
    limits_mm: Limits | None = None

    @property
    def home(self) -> float:
        """Position of the home switch, mm."""
        return self.home_mm

    @property
    def limits(self) -> tuple[float, float] | None:
        """Travel, mm."""
        return (self.limits_mm[0], self.limits_mm[1]) if self.limits_mm else None


class RevoluteActuator(_Revolute):
    """Driven hinge; without a stiffness its drive is rigid."""

    type: Literal["actuator"]
    name: Name | None = Field(None, description="default: the name of the chain")
    home_deg: float = 0.0
    limits_deg: Limits | None = None

    @property
    def home(self) -> float:
        """Position of the home switch, rad."""
        return radians(self.home_deg)

    @property
    def limits(self) -> tuple[float, float] | None:
        """Travel, rad."""
        return (radians(self.limits_deg[0]), radians(self.limits_deg[1])) if self.limits_deg else None


class PrismaticPassive(_Prismatic):
    """Free slide; with a stiffness a spring that rests at `rest_mm`."""

    type: Literal["passive"]
    rest_mm: float = 0.0
    start_mm: float = Field(0.0, description="guess of its position at robot.start_reference_mm")

    @property
    def rest(self) -> float:
        """Where its spring is relaxed, mm."""
        return self.rest_mm

    @property
    def start(self) -> float:
        """Guess at the start reference, mm."""
        return self.start_mm


class RevolutePassive(_Revolute):
    """Free hinge; with a stiffness a spring that rests at `rest_deg`."""

    type: Literal["passive"]
    rest_deg: float = 0.0
    start_deg: float = Field(0.0, description="guess of its angle at robot.start_reference_mm")

    @property
    def rest(self) -> float:
        """Where its spring is relaxed, rad."""
        return radians(self.rest_deg)

    @property
    def start(self) -> float:
        """Guess at the start reference, rad."""
        return radians(self.start_deg)


class Link(Spring):
    """An elastic link: a 6-dof spring at this place of the chain, without length."""

    type: Literal["link"]


class Parallelogram(Spec):
    """Two equal bars between hinges: the arm turns about `hinge`, the cross-bar keeps its orientation."""

    type: Literal["parallelogram"]
    arm_mm: Vector
    hinge: AxisLetter
    crossbar: AxisLetter
    width_mm: Positive
    bar: Spring
    start_deg: float = Field(0.0, description="guess of the arm's angle at robot.start_reference_mm")

    @property
    def start(self) -> float:
        """Guess at the start reference, rad."""
        return radians(self.start_deg)


class Weight(Spec):
    """Weight of a link, along machine -z at `centre_mm` of the local frame."""

    type: Literal["weight"]
    force_N: Positive
    centre_mm: Vector = Zero


Actuator = Annotated[PrismaticActuator | RevoluteActuator, Field(discriminator="joint")]
Passive = Annotated[PrismaticPassive | RevolutePassive, Field(discriminator="joint")]
Element = Annotated[
    Transform | Actuator | Passive | Link | Parallelogram | Weight, Field(discriminator="type")
]

# ---------------------------------------------------------------------------------------------------------------------
# chains and the robot


class GeometricError(Spec):
    """Where a part really is, against where it should be: translation, then rotation vector, in the chain's frame."""

    translation_mm: Vector = Zero
    rotation_deg: Vector = Zero


class Chain(Spec):
    """Elements from the base to the platform in a local frame that permutes the machine's axes.

    `frame: yzx` means: local x, y, z point along machine y, z, x. The platform end is turned back, so that at zero the
    platform's frame is parallel to the machine's.
    """

    frame: Literal["xyz", "yzx", "zxy"] = "xyz"
    base_error: GeometricError = Field(default_factory=lambda: GeometricError())
    end_error: GeometricError = Field(default_factory=lambda: GeometricError())
    elements: Annotated[list[Element], Field(min_length=1)]

    def actuators(self, chain: str) -> dict[str, PrismaticActuator | RevoluteActuator]:
        """The actuators in order by name; one that has no name of its own bears the name of the `chain`."""
        found = [each for each in self.elements if isinstance(each, PrismaticActuator | RevoluteActuator)]
        names = [each.name or chain for each in found]
        for name in names:
            if names.count(name) > 1:
                raise PydanticCustomError("CC205", f"two actuators of chain '{chain}' are called '{name}'")
        return dict(zip(names, found, strict=True))


class Robot(Spec):
    """A machine: chains that all carry the same platform."""

    name: str
    type: str | None = Field(
        None, description="member of the shelf robots that builds the chains from its parameters"
    )
    chains: Annotated[dict[Name, Chain], Field(min_length=1)]
    start_reference_mm: Vector = Field(
        default_factory=lambda: [0.0, 0.0, 0.0],
        description="platform reference point at which the start guesses of the passive joints hold",
    )

    @model_validator(mode="after")
    def _names(self) -> "Robot":
        names = [name for key, chain in self.chains.items() for name in chain.actuators(key)]
        for name in names:
            if names.count(name) > 1:
                raise PydanticCustomError("CC205", f"two actuators of the robot are called '{name}'")
        if not names:
            raise PydanticCustomError("CC205", "no chain has an actuator")
        return self

    @property
    def actuators(self) -> dict[str, PrismaticActuator | RevoluteActuator]:
        """All actuators by name, chain by chain, base to platform."""
        return {
            name: each for key, chain in self.chains.items() for name, each in chain.actuators(key).items()
        }
