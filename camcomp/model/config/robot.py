"""YAML specs of a robot: chains of elements from the base to the platform. mm, N, rad; degrees only in `_deg` keys.

Elements are in chain order, each in the local frame behind the elements before it. Joints provide `stiffness`, `home`,
`limits`, `rest`, `start` in mm or rad for both kinds, so that only this file handles the units of keys.
"""

from math import radians
from typing import Annotated, ClassVar, Literal

from pydantic import AfterValidator, Field, model_validator
from pydantic_core import PydanticCustomError

from camcomp.model.config.base import Axis, AxisLetter, Limits, Name, Positive, Spec, Vector, zero
from camcomp.model.config.links import Spring

SHORTEST_ARM_MM = 1e-6

# ---------------------------------------------------------------------------------------------------------------------
# elements


class TransformSpec(Spec):
    """A rigid step: first the translation, then the rotation (rotation vector), both in the frame before it."""

    type: Literal["transform"]
    translation_mm: Vector = zero("step along the local x, y, z")
    rotation_deg: Vector = zero("rotation vector behind the step")


class _Prismatic(Spec):
    joint: Literal["prismatic"] = Field(description="kind of the joint: a slide")
    axis: Axis = Field(description="local axis of the slide")
    stiffness_N_per_mm: Positive | None = Field(
        None,
        description="of the drive, or of the spring of a passive slide; default: a drive is rigid, a passive slide free",
    )
    rotary: ClassVar[bool] = False

    @property
    def stiffness(self) -> float | None:
        """N/mm; None = rigid drive, or free passive joint."""
        return self.stiffness_N_per_mm


class _Revolute(Spec):
    joint: Literal["revolute"] = Field(description="kind of the joint: a hinge")
    axis: Axis = Field(description="local axis of the hinge")
    stiffness_Nmm_per_rad: Positive | None = Field(
        None,
        description="of the drive, or of the spring of a passive hinge; default: a drive is rigid, a passive hinge free",
    )
    rotary: ClassVar[bool] = True

    @property
    def stiffness(self) -> float | None:
        """N mm/rad; None = rigid drive, or free passive joint."""
        return self.stiffness_Nmm_per_rad


class PrismaticActuator(_Prismatic):
    """Driven slide; without a stiffness its drive is rigid."""

    type: Literal["actuator"]
    name: Name | None = Field(None, description="default: the name of the chain")
    home_mm: float = Field(0.0, description="position of the home switch, from which screw errors count")
    start_mm: float | None = Field(None, description="position in the start pose of an arm; default: home_mm")
    limits_mm: Limits | None = Field(None, description="travel [low, high]; default: no limits are checked")

    @property
    def home(self) -> float:
        """Position of the home switch, mm."""
        return self.home_mm

    @property
    def start(self) -> float | None:
        """Position in the start pose, mm; None = home."""
        return self.start_mm

    @property
    def limits(self) -> tuple[float, float] | None:
        """Travel, mm."""
        return (self.limits_mm[0], self.limits_mm[1]) if self.limits_mm else None


class RevoluteActuator(_Revolute):
    """Driven hinge; without a stiffness its drive is rigid."""

    type: Literal["actuator"]
    name: Name | None = Field(None, description="default: the name of the chain")
    home_deg: float = Field(0.0, description="angle of the home switch")
    start_deg: float | None = Field(
        None, description="angle in the start pose, which fixes the branch of an arm; default: home_deg"
    )
    limits_deg: Limits | None = Field(None, description="travel [low, high]; default: no limits are checked")

    @property
    def home(self) -> float:
        """Position of the home switch, rad."""
        return radians(self.home_deg)

    @property
    def start(self) -> float | None:
        """Angle in the start pose, rad; None = home."""
        return None if self.start_deg is None else radians(self.start_deg)

    @property
    def limits(self) -> tuple[float, float] | None:
        """Travel, rad."""
        return (radians(self.limits_deg[0]), radians(self.limits_deg[1])) if self.limits_deg else None


class PrismaticPassive(_Prismatic):
    """Free slide; with a stiffness a spring that rests at `rest_mm`."""

    type: Literal["passive"]
    rest_mm: float = Field(0.0, description="position at which its spring is relaxed")
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
    rest_deg: float = Field(0.0, description="angle at which its spring is relaxed")
    start_deg: float = Field(0.0, description="guess of its angle at robot.start_reference_mm")

    @property
    def rest(self) -> float:
        """Where its spring is relaxed, rad."""
        return radians(self.rest_deg)

    @property
    def start(self) -> float:
        """Guess at the start reference, rad."""
        return radians(self.start_deg)


class LinkSpec(Spring):
    """An elastic link: a 6-dof spring at this place of the chain, without length."""

    type: Literal["link"]


def _some_length(arm: list[float]) -> list[float]:
    if max(map(abs, arm)) < SHORTEST_ARM_MM:
        raise PydanticCustomError("CC205", "an arm without length has no direction")
    return arm


class ParallelogramSpec(Spec):
    """Two equal bars between hinges: the arm turns about `hinge`, the cross-bar keeps its orientation."""

    type: Literal["parallelogram"]
    arm_mm: Annotated[Vector, AfterValidator(_some_length)] = Field(
        description="vector from the first to the second hinge, at angle zero"
    )
    hinge: AxisLetter = Field(description="local axis about which the arm turns")
    crossbar: AxisLetter = Field(description="local axis of the cross-bar")
    width_mm: Positive = Field(description="distance of the two bars")
    bar: Spring = Field(description="spring of one bar")
    start_deg: float = Field(0.0, description="guess of the arm's angle at robot.start_reference_mm")

    @property
    def start(self) -> float:
        """Guess at the start reference, rad."""
        return radians(self.start_deg)


class WeightSpec(Spec):
    """Weight of a link, along machine -z at `centre_mm` of the local frame."""

    type: Literal["weight"]
    force_N: Positive = Field(description="weight of the link")
    centre_mm: Vector = zero("centre of mass in the local frame")


Actuator = Annotated[PrismaticActuator | RevoluteActuator, Field(discriminator="joint")]
Passive = Annotated[PrismaticPassive | RevolutePassive, Field(discriminator="joint")]
Element = Annotated[
    TransformSpec | Actuator | Passive | LinkSpec | ParallelogramSpec | WeightSpec, Field(discriminator="type")
]

# ---------------------------------------------------------------------------------------------------------------------
# chains and the robot


class GeometricError(Spec):
    """Error of a part's pose: translation, then rotation vector, in the chain's frame."""

    translation_mm: Vector = zero("shift in the chain's frame")
    rotation_deg: Vector = zero("rotation vector in the chain's frame")


class ChainSpec(Spec):
    """Elements from the base to the platform in a local frame that permutes the machine's axes.

    `frame: yzx` means: local x, y, z point along machine y, z, x. The platform end is rotated back, so that at zero the
    platform's frame is parallel to the machine's.
    """

    frame: Literal["xyz", "yzx", "zxy"] = Field("xyz", description="machine axes along which the local x, y, z point")
    base_error: GeometricError = Field(
        default_factory=lambda: GeometricError(), description="where the chain's base really is"
    )
    end_error: GeometricError = Field(
        default_factory=lambda: GeometricError(), description="where the chain's end on the platform really is"
    )
    elements: Annotated[list[Element], Field(min_length=1)] = Field(
        description="joints, links and steps from the base to the platform"
    )

    def actuators(self, chain: str) -> dict[str, PrismaticActuator | RevoluteActuator]:
        """The actuators in order by name; the default name is that of the `chain`."""
        found = [each for each in self.elements if isinstance(each, PrismaticActuator | RevoluteActuator)]
        return {each.name or chain: each for each in found}


class RobotSpec(Spec):
    """A machine: chains that all carry the same platform."""

    name: str = Field(description="name of the machine, in reports")
    type: str | None = Field(
        None, examples=["serial"], description="member of the shelf robots that builds the chains from its parameters"
    )
    chains: Annotated[dict[Name, ChainSpec], Field(min_length=1)] = Field(
        description="kinematic chains by name; all carry the same platform"
    )
    start_reference_mm: Vector = Field(
        default_factory=lambda: [0.0, 0.0, 0.0],
        description="platform reference point at which the start guesses of the passive joints hold; an arm's start "
        "pose follows from the start angles of its joints instead",
    )

    @model_validator(mode="after")
    def _names(self) -> "RobotSpec":
        chain_of: dict[str, str] = {}
        for key, chain in self.chains.items():
            for i, each in enumerate(chain.elements):
                if not isinstance(each, PrismaticActuator | RevoluteActuator):
                    continue
                if (name := each.name or key) in chain_of:
                    whose = f"chain '{key}'" if chain_of[name] == key else "the robot"
                    below = ("chains", key, "elements", i, *(("name",) if each.name else ()))
                    raise PydanticCustomError(
                        "CC205", f"two actuators of {whose} are called '{name}'", {"below": below}
                    )
                chain_of[name] = key
        if not chain_of:
            raise PydanticCustomError("CC205", "no chain has an actuator")
        return self

    @property
    def actuators(self) -> dict[str, PrismaticActuator | RevoluteActuator]:
        """All actuators by name, chain by chain, base to platform."""
        return {name: each for key, chain in self.chains.items() for name, each in chain.actuators(key).items()}
