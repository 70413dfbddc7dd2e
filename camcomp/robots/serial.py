"""A serial arm from its table of joint and link parameters (Denavit-Hartenberg, in either convention).

Row i of the table is the joint i and the link behind it. With the joint coordinate q, theta = theta_deg + q for a
revolute joint and d = d_mm + q for a prismatic one:

    convention: dh         Rot_z(theta) Trans_z(d) Trans_x(a) Rot_x(alpha)     a and alpha stand behind the joint
    convention: modified   Rot_x(alpha) Trans_x(a) Rot_z(theta) Trans_z(d)     they stand in front of it

Sources: Denavit, Hartenberg, J. Appl. Mech. 22 (1955) 215-221; Craig, Introduction to Robotics (the modified table).
The frame behind a row is its link's frame: masses and elastic links are given there.
"""

from math import atan2, cos, degrees, hypot, radians, sin
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator
from pydantic_core import PydanticCustomError

from camcomp.ground.datatypes import STANDARD_GRAVITY
from camcomp.model.config.base import Limits, Name, Positive, Spec, Vector, zero
from camcomp.model.config.links import Spring


class Pose(Spec):
    """A rigid step: first the translation, then the rotation (rotation vector)."""

    translation_mm: Vector = zero("step along x, y, z")
    rotation_deg: Vector = zero("rotation vector behind the step")


class Joint(Spec):
    """A row of the table: a driven joint, its spring, and the link that it moves."""

    name: Name = Field(description="name of the actuator")
    joint: Literal["revolute", "prismatic"] = Field("revolute", description="kind of the joint")
    a_mm: float = Field(0.0, description="length of the link")
    alpha_deg: float = Field(0.0, description="twist of the link")
    d_mm: float = Field(0.0, description="offset along the joint's axis")
    theta_deg: float = Field(0.0, description="angle of the joint at its zero")
    reversed: bool = Field(False, description="the control counts the joint the other way round")
    stiffness_Nmm_per_rad: Positive | None = Field(None, description="of the drive of a hinge; default: rigid")
    stiffness_N_per_mm: Positive | None = Field(None, description="of the drive of a slide; default: rigid")
    home_deg: float | None = Field(None, description="angle of the home switch; default: 0")
    home_mm: float | None = Field(None, description="position of the home switch; default: 0")
    start_deg: float | None = Field(None, description="in the start pose, which fixes the branch; default: home")
    start_mm: float | None = Field(None, description="position in the start pose; default: home")
    limits_deg: Limits | None = Field(None, description="travel [low, high] of a hinge; default: no limits are checked")
    limits_mm: Limits | None = Field(None, description="travel [low, high] of a slide; default: no limits are checked")
    mass_kg: Positive | None = Field(None, description="mass of the link behind the joint")
    centre_mm: Vector | None = Field(None, description="of mass, in the frame behind the row")
    link: Spring | None = Field(None, description="elastic link: a 6-dof spring in the frame behind the row")

    @model_validator(mode="after")
    def _units(self) -> "Joint":
        wrong = ("_N_per_mm", "_mm") if self.joint == "revolute" else ("_Nmm_per_rad", "_deg")
        for key in ("stiffness" + wrong[0], *(stem + wrong[1] for stem in ("home", "start", "limits"))):
            if getattr(self, key) is not None:
                raise PydanticCustomError("CC205", f"{key} does not go with a {self.joint} joint")
        if self.centre_mm is not None and self.mass_kg is None:
            raise PydanticCustomError("CC205", "centre_mm needs mass_kg")
        return self


class Params(Spec):
    """Table of an arm. base: first joint's frame in the machine frame; flange: platform frame behind the last row.

    The platform frame stands at the tool's reference point, its z axis points away from the workpiece.
    """

    convention: Literal["dh", "modified"] = Field(description="dh: Denavit and Hartenberg; modified: Craig")
    chain: Name = Field("arm", description="name of the one chain")
    base: Pose = Field(default_factory=lambda: Pose(), description="frame of the first joint in the machine frame")
    flange: Pose = Field(default_factory=lambda: Pose(), description="platform frame behind the last row")
    joints: Annotated[list[Joint], Field(min_length=1)] = Field(
        description="rows of the table from the base to the flange"
    )

    @model_validator(mode="after")
    def _names(self) -> "Params":
        names = [row.name for row in self.joints]
        for i, name in enumerate(names):
            if name in names[:i]:
                raise PydanticCustomError("CC205", f"two joints are called '{name}'", {"below": ("joints", i, "name")})
        return self


def chains(params: Params) -> dict[str, Any]:
    """The single chain of the arm, in the keys of a machine file."""
    elements = _step(params.base)
    for row in params.joints:
        elements += _row(row, modified=params.convention == "modified")
    elements += _step(params.flange)
    return {params.chain: {"elements": elements}}


def _turned(*about: tuple[str, float]) -> list[float]:
    """Rotation vector (3,) deg of turns about z or x, in deg, one after the other in moving axes; by quaternions."""
    w, x, y, z = 1.0, 0.0, 0.0, 0.0
    for axis, angle in about:
        c, s = cos(radians(angle) / 2.0), sin(radians(angle) / 2.0)
        if axis == "x":
            w, x, y, z = w * c - x * s, x * c + w * s, y * c + z * s, z * c - y * s
        else:
            w, x, y, z = w * c - z * s, x * c + y * s, y * c - x * s, z * c + w * s
    size = hypot(x, y, z)
    if size == 0.0:
        return [0.0, 0.0, 0.0]
    angle = 2.0 * degrees(atan2(size, w))
    return [angle * each / size for each in (x, y, z)]


def _step(pose: Pose) -> list[dict[str, Any]]:
    return _transform(list(pose.translation_mm), list(pose.rotation_deg))


def _transform(translation: list[float], rotation: list[float]) -> list[dict[str, Any]]:
    if not any(translation) and not any(rotation):
        return []
    return [{"type": "transform", "translation_mm": translation, "rotation_deg": rotation}]


_PASSED_ON = (
    "stiffness_Nmm_per_rad", "stiffness_N_per_mm", "home_deg", "home_mm", "start_deg", "start_mm", "limits_deg",
    "limits_mm", "source",
)  # fmt: skip


def _row(row: Joint, *, modified: bool) -> list[dict[str, Any]]:
    given = {key: value for key in _PASSED_ON if (value := getattr(row, key)) is not None}
    axis = "-z" if row.reversed else "z"
    out = _transform([row.a_mm, 0.0, 0.0], _turned(("x", row.alpha_deg))) if modified else []
    out.append({"type": "actuator", "name": row.name, "joint": row.joint, "axis": axis, **given})
    if modified:
        out += _transform([0.0, 0.0, row.d_mm], _turned(("z", row.theta_deg)))
    else:
        c, s = cos(radians(row.theta_deg)), sin(radians(row.theta_deg))
        turn = _turned(("z", row.theta_deg), ("x", row.alpha_deg))
        out += _transform([row.a_mm * c, row.a_mm * s, row.d_mm], turn)
    if row.link is not None:
        out.append({"type": "link", **row.link.model_dump(by_alias=True, exclude_none=True)})
    if row.mass_kg is not None:
        centre = row.centre_mm or [0.0, 0.0, 0.0]
        out.append({"type": "weight", "force_N": row.mass_kg * STANDARD_GRAVITY, "centre_mm": centre})
    return out
