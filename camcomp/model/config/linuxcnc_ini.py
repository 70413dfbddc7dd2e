"""LinuxCNC's INI file as a layer of the configuration: speed, acceleration, travel and tool table of the control.

`--config machine.yaml --config machine.ini` lays it over the machine file. Travel is taken where [KINS] KINEMATICS is
trivkins, whose joints are the axes; joints of other kinematics have zeros of their own, and a warning says so.

Source: LinuxCNC manual, "INI Configuration", sections EMCIO, KINS, TRAJ, AXIS_(letter), JOINT_(num).
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping

from camcomp.gcode.stated import INCH_MM
from camcomp.ground.bounds import number_of
from camcomp.ground.errors import CamcompError, ConfigError, Location
from camcomp.ground.records import dataclass, field, replace
from camcomp.model.config.doubt import Doubt
from camcomp.model.config.yaml_tree import Node, child

SUFFIX = ".ini"
TRAVEL = "travel of LinuxCNC's axes"  # key of a merged tree under which the travel waits for the actuators
_SECTION = re.compile(r"\[([A-Z][A-Z0-9_]*)\]")
_ENTRY = re.compile(r"([A-Za-z][A-Za-z0-9_]*)\s*=\s*(.*)")
_STARTUP_UNIT = re.compile(r"G\s*2([01])(?![0-9.])", re.IGNORECASE)
_UNITS_MM = {"mm": 1.0, "metric": 1.0, "inch": INCH_MM, "imperial": INCH_MM, "in": INCH_MM}
_LINEAR = "XYZ"


def read_ini(data: bytes, name: str) -> Node:
    """The tree of a machine file with the statements of an INI file. Raises ConfigError CC218, CC204, CC205 with the place."""
    ini = _Ini(name)
    ini.read(data.decode("utf-8-sig", errors="replace"))
    at = Location(name, 1, 1)
    if not any(section in ini.sections for section in ("TRAJ", "KINS", "EMCMOT")):
        raise ConfigError("CC218", "this is no INI file of LinuxCNC: it has none of its sections", at=at)
    tree: dict[str, Node] = {}
    if control := ini.control():
        tree["control"] = Node(control, at)
    if (table := ini.text("EMCIO", "TOOL_TABLE")) is not None:
        unit = Node("mm" if ini.unit_mm == 1.0 else "inch", table.at)
        tree["tools"] = Node(
            {"file": table, **({"unit": unit} if table.value.lower().endswith(".tbl") else {})}, table.at
        )
    tree[TRAVEL] = ini.travel()
    return Node(tree, at)


def with_travel(tree: Node) -> tuple[Node, list[Doubt]]:
    """A merged tree in which the actuators called like LinuxCNC's axes have their travel, and doubts about values that were ignored."""
    travel = child(tree, TRAVEL)
    if travel is None:
        return tree, []
    values = {key: each for key, each in tree.value.items() if key != TRAVEL}
    if isinstance(travel.value, str):
        return replace(tree, value=values), [Doubt(travel.value, travel.at)]
    limited = _Limited(travel.value)
    if robot := child(tree, "robot"):
        values["robot"] = limited.into(robot)
    left = [name for name in travel.value if name not in limited.found]
    why = "is no slide of a machine of one chain, so the travel of this axis is not taken"
    doubts = [Doubt(f"'{name}' {why}", travel.value[name].at) for name in left]
    return replace(tree, value=values), doubts


@dataclass
class _Ini:
    """Sections with their keys as written; the first value of a key counts, as in LinuxCNC."""

    name: str
    sections: dict[str, dict[str, Node]] = field(default_factory=dict)
    unit_mm: float = 1.0

    def read(self, text: str) -> None:
        """Every key with its place, and the unit of length."""
        keys: dict[str, Node] = {}
        for count, line in enumerate(text.splitlines(), 1):
            stripped = line.strip()
            if found := _SECTION.match(stripped):
                keys = self.sections.setdefault(found[1], {})
            elif stripped[:1] not in ("#", ";") and (entry := _ENTRY.match(stripped)):
                column = len(line) - len(line.lstrip()) + entry.start(2) + 1
                keys.setdefault(entry[1], Node(entry[2].strip(), Location(self.name, count, column, line)))
        unit = self.text("TRAJ", "LINEAR_UNITS")
        if unit is not None and unit.value.lower() not in _UNITS_MM:
            raise ConfigError("CC205", f"[TRAJ] LINEAR_UNITS: '{unit.value}' is neither mm nor inch", at=unit.at)
        self.unit_mm = _UNITS_MM[unit.value.lower()] if unit is not None else 1.0

    def text(self, section: str, key: str) -> Node | None:
        """A value that is there and not empty."""
        found = self.sections.get(section, {}).get(key)
        return found if found is not None and found.value else None

    def number(self, section: str, key: str) -> Node | None:
        """A length, speed or acceleration in mm. Raises ConfigError CC204."""
        found = self.text(section, key)
        if found is None:
            return None
        value = number_of(found.value.split()[0])
        if value is None:
            raise ConfigError("CC204", f"[{section}] {key}: '{found.value}' is not a number", at=found.at)
        return replace(found, value=round(value * self.unit_mm, 9))

    def control(self) -> dict[str, Node]:
        """Lowest speed and acceleration of the linear axes, of which the machine file has one each; unit before G20 or G21."""
        out: dict[str, Node] = {}
        for key, theirs, whole in (
            ("velocity_mm_per_s", "MAX_VELOCITY", "MAX_LINEAR_VELOCITY"),
            ("acceleration_mm_per_s2", "MAX_ACCELERATION", "MAX_LINEAR_ACCELERATION"),
        ):
            places = [("TRAJ", whole), *((section, theirs) for section in self._linear())]
            found = [each for section, name in places if (each := self.number(section, name)) is not None]
            if found:
                out[key] = min(found, key=lambda each: float(each.value))
        startup, unit = self.text("RS274NGC", "RS274NGC_STARTUP_CODE"), self.text("TRAJ", "LINEAR_UNITS")
        if startup is not None and (code := _STARTUP_UNIT.search(startup.value)):
            out["program_unit"] = Node("inch" if code[1] == "0" else "mm", startup.at)
        elif unit is not None:
            out["program_unit"] = Node("mm" if self.unit_mm == 1.0 else "inch", unit.at)
        return out

    def travel(self) -> Node:
        """Travel [low, high] mm by axis in small letters; why none is taken, for other kinematics."""
        kinds = self.text("KINS", "KINEMATICS")
        if kinds is not None and kinds.value.split()[0] != "trivkins":
            text = f"joints of {kinds.value.split()[0]} have zeros of their own, so their travel is not taken"
            return Node(text, kinds.at)
        out: dict[str, Node] = {}
        for letter in _LINEAR:
            ends: list[Node] = []
            for key, narrower in (("MIN_LIMIT", max), ("MAX_LIMIT", min)):
                found = [each for section in self._of(letter) if (each := self.number(section, key)) is not None]
                if found:
                    ends.append(narrower(found, key=lambda each: float(each.value)))
            if len(ends) == 2:
                out[letter.lower()] = Node(ends, ends[0].at)
        return Node(out, kinds.at if kinds is not None else Location(self.name, 1, 1))

    def _linear(self) -> Iterator[str]:
        for letter in _LINEAR:
            yield from self._of(letter)

    def _of(self, letter: str) -> list[str]:
        """Sections of an axis and of the joints that drive it."""
        kinds = self.text("KINS", "KINEMATICS")
        stated = re.search(r"coordinates=(\w+)", kinds.value) if kinds is not None else None
        order = stated[1].upper() if stated else "XYZABCUVW"
        joints = [f"JOINT_{k}" for k, each in enumerate(order) if each == letter]
        return [each for each in (f"AXIS_{letter}", *joints) if each in self.sections]


@dataclass
class _Limited:
    """Writes the travel of axes into the slides of their names in a machine of one chain. found: axes whose slide is there."""

    travel: Mapping[str, Node]
    found: set[str] = field(default_factory=set)

    def into(self, robot: Node) -> Node:
        """A robot of chains, or of a table of joints."""
        if not isinstance(robot.value, dict):
            return robot
        values = dict(robot.value)
        for key in ("chains", "joints"):
            part = child(robot, key)
            if part is not None and isinstance(part.value, dict) and len(part.value) == 1:
                values[key] = replace(part, value={name: self._chain(name, each) for name, each in part.value.items()})
            elif part is not None and isinstance(part.value, list):
                values[key] = replace(part, value=[self._element("", each) for each in part.value])
        return replace(robot, value=values)

    def _chain(self, name: str, chain: Node) -> Node:
        elements = child(chain, "elements")
        if elements is None or not isinstance(elements.value, list):
            return chain
        limited = [self._element(name, each) for each in elements.value]
        return replace(chain, value={**chain.value, "elements": replace(elements, value=limited)})

    def _element(self, chain: str, element: Node) -> Node:
        """An actuator without a name bears that of its chain."""
        if not isinstance(element.value, dict):
            return element
        given = {key: each.value for key, each in element.value.items()}
        slide = given.get("joint") == "prismatic" and given.get("type", "actuator") == "actuator"
        name = str(given.get("name", chain)).lower()
        if not slide or name not in self.travel:
            return element
        self.found.add(name)
        return replace(element, value={**element.value, "limits_mm": self.travel[name]})


def read_layer(data: bytes, name: str) -> tuple[Node | None, list[CamcompError]]:
    """The tree of an INI file, or its errors."""
    try:
        return read_ini(data, name), []
    except ConfigError as error:
        return None, [error]
