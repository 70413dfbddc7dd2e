"""Arms from URDF files: geometry, limits, masses and centres of mass, as the robot section of a machine file.

A URDF contains no stiffness. The keys are written as comments, to be filled in; until then joints and links are
rigid. Lengths become mm, angles deg. Format: http://wiki.ros.org/urdf/XML.
"""

from __future__ import annotations

import io
import json
import re
from math import degrees
from xml.sax import SAXParseException, handler, make_parser
from xml.sax.xmlreader import InputSource

import numpy as np
from numpy.typing import NDArray

from camcomp.ground.bounds import number_of
from camcomp.ground.datatypes import STANDARD_GRAVITY
from camcomp.ground.errors import ConfigError, Location
from camcomp.ground.records import dataclass, field

LARGEST_M = 1e12  # of any number: m, kg, rad
MOST_BYTES = 1 << 23
MOST_PARTS = 2000  # links and joints; an arm has some twenty
MOVING = {"revolute": "revolute", "continuous": "revolute", "prismatic": "prismatic"}
Array = NDArray[np.float64]


@dataclass
class UrdfNode:
    """An XML element: tag, attributes, line in the file, children."""

    tag: str
    given: dict[str, str]
    line: int
    below: list[UrdfNode] = field(default_factory=list)

    def first(self, tag: str) -> UrdfNode | None:
        """First child of this tag."""
        return next((each for each in self.below if each.tag == tag), None)


class _UrdfReader(handler.ContentHandler):
    """Build the tree of UrdfNodes; text between tags has no meaning in a URDF."""

    def __init__(self) -> None:
        super().__init__()
        self.root: UrdfNode | None = None
        self.open: list[UrdfNode] = []

    def setDocumentLocator(self, locator: object) -> None:
        self.locator = locator

    def startElement(self, name: str, attrs: object) -> None:
        node = UrdfNode(name, dict(attrs.items()), self.locator.getLineNumber())  # type: ignore[attr-defined]
        if self.open:
            self.open[-1].below.append(node)
        else:
            self.root = node
        self.open.append(node)

    def endElement(self, name: str) -> None:
        self.open.pop()


@dataclass(frozen=True)
class UrdfArm:
    """A chain of a URDF as lines of a machine file, without indent. moving: names of its joints; notes for the reader."""

    name: str
    lines: tuple[str, ...]
    moving: tuple[str, ...]
    notes: tuple[str, ...]


def read_urdf(data: bytes, name: str, tip: str | None = None, base: str | None = None) -> UrdfArm:
    """Read the chain from the link `base` (default: the root) to the link `tip`.

    Default of `tip`: the only leaf, or the one behind most joints. Joints that follow another one (mimic), such as those of a
    gripper, are fixed at the position for a leader at zero.

    Raises:
        ConfigError: CC240 with file and line, no URDF, or no chain of hinges and slides.
    """
    root = _parse(data, name)

    def refuse(text: str, node: UrdfNode, hint: str = "") -> ConfigError:
        return ConfigError(
            "CC240", _on_one_line(text), at=Location(name, node.line, 1), hint=_on_one_line(hint) or None
        )

    if len(root.below) > MOST_PARTS:
        raise refuse(f"more than {MOST_PARTS} links and joints", root)
    links = {each.given.get("name", ""): each for each in root.below if each.tag == "link"}
    joints = [each for each in root.below if each.tag == "joint"]
    parent: dict[str, UrdfNode] = {}
    for joint in joints:
        child = _link(joint, "child")
        if child not in links or _link(joint, "parent") not in links:
            raise refuse(f"joint '{joint.given.get('name')}' connects links that are not there", joint)
        if child in parent:
            raise refuse(f"link '{child}' hangs on two joints; closed chains cannot be read from a URDF", joint)
        parent[child] = joint
    if not joints:
        raise refuse("there is no joint", root)
    used = {_link(joint, "parent") for joint in joints}
    leaves = [each for each in links if each not in used]
    routes = {leaf: _route(leaf, parent, refuse) for leaf in ([tip] if tip is not None else leaves) if leaf in links}
    if not routes:
        raise refuse(f"there is no link '{tip}'", root, f"ends of chains: {', '.join(leaves)}")
    if base is not None:
        routes = _from_base(routes, base, links, root, refuse)
    count = {leaf: sum(_drives(joint) for joint in route) for leaf, route in routes.items()}
    most = [leaf for leaf, n in count.items() if n == max(count.values())]
    lengths = {leaf: len(routes[leaf]) for leaf in most}
    longest = [leaf for leaf in most if lengths[leaf] == max(lengths.values())]
    if len(longest) > 1:
        raise refuse("the robot has several ends", root, f"choose one with --tip: {', '.join(sorted(longest))}")
    return _arm(root.given.get("name", "robot"), routes[longest[0]], links, longest[0], refuse)


def _parse(data: bytes, name: str) -> UrdfNode:
    if len(data) > MOST_BYTES:
        raise ConfigError("CC240", f"more than {MOST_BYTES} bytes", at=Location(name, 1, 1))
    reader, parser = _UrdfReader(), make_parser()
    parser.setContentHandler(reader)
    source = InputSource()
    source.setByteStream(io.BytesIO(data))
    try:
        parser.parse(source)
    except SAXParseException as error:
        at = Location(name, error.getLineNumber() or 1, (error.getColumnNumber() or 0) + 1)
        raise ConfigError("CC240", f"not XML: {error.getMessage()}", at=at) from error
    except (LookupError, ValueError) as error:  # encodings unknown to Python, or not for text
        raise ConfigError("CC240", "not XML: its encoding is not known", at=Location(name, 1, 1)) from error
    root = reader.root
    assert root is not None
    if root.tag != "robot":
        raise ConfigError("CC240", f"the root is <{root.tag}>, not <robot>", at=Location(name, root.line, 1))
    if any(each.tag.startswith("xacro:") for each in root.below):
        at = Location(name, next(e.line for e in root.below if e.tag.startswith("xacro:")), 1)
        raise ConfigError(
            "CC240", "xacro macros are not followed", at=at, hint="expand it first: xacro FILE > robot.urdf"
        )
    return root


def _link(joint: UrdfNode, tag: str) -> str:
    node = joint.first(tag)
    return "" if node is None else node.given.get("link", "")


def _route(leaf: str, parent: dict[str, UrdfNode], refuse) -> list[UrdfNode]:  # type: ignore[no-untyped-def]
    route: list[UrdfNode] = []
    while leaf in parent:
        joint = parent[leaf]
        if joint in route:
            raise refuse("the joints go round in a circle", joint)
        route.append(joint)
        leaf = _link(joint, "parent")
    return route[::-1]


def _from_base(  # type: ignore[no-untyped-def]
    routes: dict[str, list[UrdfNode]], base: str, links: dict[str, UrdfNode], root: UrdfNode, refuse
) -> dict[str, list[UrdfNode]]:
    """The parts of routes behind the link `base`, for the routes that pass it."""
    if base not in links:
        raise refuse(f"there is no link '{base}'", root, f"links: {', '.join(list(links)[:20])}")
    out = {}
    for leaf, route in routes.items():
        parents = [_link(joint, "parent") for joint in route]
        if base in parents:
            out[leaf] = route[parents.index(base) :]
    if not out:
        raise refuse(f"no chain to {' or '.join(routes)} passes the link '{base}'", links[base])
    return out


def _drives(joint: UrdfNode) -> bool:
    """Whether a joint has a drive of its own."""
    return joint.given.get("type") in MOVING and joint.first("mimic") is None


def _numbers(node: UrdfNode | None, key: str, default: tuple[float, float, float], refuse) -> Array:  # type: ignore[no-untyped-def]
    if node is None or key not in node.given:
        return np.array(default)
    try:
        return np.array([_value(each) for each in node.given[key].split()], float).reshape(3)
    except ValueError:
        raise refuse(f'{key}="{node.given[key][:60]}" is not three numbers', node) from None


def _number(node: UrdfNode | None, key: str, refuse) -> float | None:  # type: ignore[no-untyped-def]
    if node is None or key not in node.given:
        return None
    try:
        return _value(node.given[key])
    except ValueError:
        raise refuse(f'{key}="{node.given[key][:60]}" is not a number', node) from None


def _value(text: str) -> float:
    value = number_of(text)
    if value is None or not abs(value) <= LARGEST_M:
        raise ValueError(text)
    return value


def _on_one_line(text: str) -> str:
    """Text of the file on one line, for comments and messages: names in XML may contain line ends and control characters."""
    return " ".join("".join(each if each.isprintable() else " " for each in text).split())


def rotation_vector_deg(rpy: Array) -> Array:
    """Rotation vector (3,) deg of roll, pitch, yaw (3,) rad about fixed axes x, y, z."""
    half = 0.5 * rpy
    (cr, cp, cy), (sr, sp, sy) = np.cos(half), np.sin(half)
    w = cr * cp * cy + sr * sp * sy
    v = np.array([sr * cp * cy - cr * sp * sy, cr * sp * cy + sr * cp * sy, cr * cp * sy - sr * sp * cy])
    if w < 0:
        w, v = -w, -v
    size = float(np.linalg.norm(v))
    return np.zeros(3) if size < 1e-15 else v / size * degrees(2.0 * np.arctan2(size, w))


def _list(values: Array) -> str:
    return (
        "[" + ", ".join(f"{round(float(v), 9) + 0.0:g}" if abs(v) < 1e-9 else f"{float(v):.9g}" for v in values) + "]"
    )


def _step(origin: UrdfNode | None, refuse) -> list[str]:  # type: ignore[no-untyped-def]
    at = 1e3 * _numbers(origin, "xyz", (0.0, 0.0, 0.0), refuse)
    turn = rotation_vector_deg(_numbers(origin, "rpy", (0.0, 0.0, 0.0), refuse))
    if not at.any() and np.abs(turn).max() < 1e-12:
        return []
    return [f"- {{type: transform, translation_mm: {_list(at)}, rotation_deg: {_list(turn)}}}"]


def _arm(title: str, route: list[UrdfNode], links: dict[str, UrdfNode], tip: str, refuse) -> UrdfArm:  # type: ignore[no-untyped-def]
    lines: list[str] = []
    moving: list[str] = []
    notes: list[str] = []
    for joint in route:
        kind, label = joint.given.get("type", ""), joint.given.get("name", "")
        child = _link(joint, "child")
        lines.append(_on_one_line(f"# {label} ({kind}) to {child}"))
        lines += _step(joint.first("origin"), refuse)
        if kind in MOVING and not _drives(joint):
            lines += _following(joint, label, kind, route, refuse)
            notes.append(f"joint '{label}' follows another one, and stands where that is at zero")
        elif kind in MOVING:
            lines += _joint(joint, label, kind, refuse)
            moving.append(_name(label))
        elif kind != "fixed":
            raise refuse(f"joint '{label}' is {kind or 'of no type'}", joint, "fixed, revolute, continuous, prismatic")
        lines += _weight(links[child], child, refuse, notes)
    if len(set(moving)) < len(moving):
        raise refuse(f"names of joints are not unique as column names: {', '.join(moving)}", route[0])
    lines.append("# The platform's z axis points away from the workpiece; that of a flange points out of it.")
    lines.append("- {type: transform, rotation_deg: [180, 0, 0]}")
    if len(moving) not in (3, 6):
        notes.append(f"{len(moving)} driven joints; camcomp needs three or six")
    notes.insert(0, f"chain to link '{tip}': {', '.join(moving)}")
    return UrdfArm(_on_one_line(title), tuple(lines), tuple(moving), tuple(map(_on_one_line, notes)))


def _following(joint: UrdfNode, label: str, kind: str, route: list[UrdfNode], refuse) -> list[str]:  # type: ignore[no-untyped-def]
    """The rigid step of a joint that follows one outside the chain. Raises ConfigError CC240 where its leader is in the chain."""
    mimic = joint.first("mimic")
    leader = mimic.given.get("joint", "") if mimic is not None else ""
    if leader in {each.given.get("name") for each in route}:
        hint = "coupled joints of the arm itself cannot be modelled; --tip names a link in front of it"
        raise refuse(f"joint '{label}' follows joint '{leader}' of the same chain", joint, hint)
    offset = _number(mimic, "offset", refuse) or 0.0
    axis = _numbers(joint.first("axis"), "xyz", (1.0, 0.0, 0.0), refuse)
    if not axis.any():
        raise refuse(f"axis of joint '{label}' is zero", joint)
    step = offset * axis / np.linalg.norm(axis)
    if not step.any():
        return []
    if MOVING[kind] == "revolute":
        return [f"- {{type: transform, rotation_deg: {_list(np.degrees(step))}}}"]
    return [f"- {{type: transform, translation_mm: {_list(1e3 * step)}}}"]


def _name(label: str) -> str:
    """A name that may become part of a column."""
    plain = re.sub(r"[^A-Za-z0-9_]", "_", label)
    return plain if re.match(r"[A-Za-z]", plain) else f"j{plain}"


def _joint(joint: UrdfNode, label: str, kind: str, refuse) -> list[str]:  # type: ignore[no-untyped-def]
    axis = _numbers(joint.first("axis"), "xyz", (1.0, 0.0, 0.0), refuse)
    if not axis.any():
        raise refuse(f"axis of joint '{label}' is zero", joint)
    hinge = MOVING[kind] == "revolute"
    limit = joint.first("limit")
    low, high = _number(limit, "lower", refuse), _number(limit, "upper", refuse)
    factor, unit = (degrees(1.0), "deg") if hinge else (1e3, "mm")
    span = ""
    start = 0.0
    if kind != "continuous" and low is not None and high is not None and low < high:
        span = f", limits_{unit}: [{factor * low:.9g}, {factor * high:.9g}]"
        start = min(max(0.0, factor * low), factor * high)
    spring = "stiffness_Nmm_per_rad: 1.0e+9" if hinge else "stiffness_N_per_mm: 1.0e+5"
    return [
        f"- {{type: actuator, name: {_name(label)}, joint: {MOVING[kind]}, axis: {_list(axis)}, start_{unit}: {start:.9g}{span}}}",
        f"#   {spring}   # a URDF does not know it: put the joint's own value into the braces",
    ]


def _weight(link: UrdfNode, name: str, refuse, notes: list[str]) -> list[str]:  # type: ignore[no-untyped-def]
    inertial = link.first("inertial")
    mass = _number(inertial.first("mass") if inertial else None, "value", refuse)
    if inertial is None or mass is None or mass <= 0.0:
        notes.append(f"link '{name}' has no mass")
        return []
    centre = 1e3 * _numbers(inertial.first("origin"), "xyz", (0.0, 0.0, 0.0), refuse)
    return [
        f"- {{type: weight, force_N: {mass * STANDARD_GRAVITY:.9g}, centre_mm: {_list(centre)}}}   # {mass:g} kg",
        "# - {type: link, compliance_diagonal: {translation_mm_per_N: [0, 0, 0], rotation_rad_per_Nmm: [0, 0, 0]}}",
    ]


def machine_yaml(arm: UrdfArm, source: str) -> str:
    """A machine file around the arm."""
    body = "\n".join(f"        {line}" for line in arm.lines)
    return f"""# yaml-language-server: $schema=camcomp.schema.json
#
# Written from {_on_one_line(source)}: geometry, limits and masses. Fill in what a URDF does not know:
#   1. stiffness of the joints, compliance of the links (commented keys below); without them everything is rigid
#   2. start angles: a posture near the work, not singular; they fix the branch of the inverse kinematics
#   3. workpiece, tool and cutting force
robot:
  name: {json.dumps(arm.name, ensure_ascii=False)}
  source: {json.dumps(_on_one_line(source), ensure_ascii=False)}
  chains:
    arm:
      elements:
{body}

workpiece:
  origin_mm: [1000, 0, 0]   # of the program, in the frame of the root link

tool:
  length_mm: 100

process:
  force: {{model: constant, Fr_N: 215, Ft_N: -10, Fz_N: -25}}

control:
  resolution_mm: 0.001

compensation:
  method: newton
  tolerance_um: 1.0
"""
