"""Tools of a machine file that stand in a table of another program: `tools: {file: tool.tbl}`.

A reader per kind of file lies in `camcomp/tool_tables`, found by the suffix of the file. What the machine file states
of a tool itself counts, and what contradicts it is a warning with both values.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from camcomp.gcode.stated import INCH_MM
from camcomp.ground import shelf
from camcomp.ground.errors import CamcompError, ConfigError, Location
from camcomp.ground.files import display_name, read_bytes
from camcomp.ground.records import dataclass, field, replace
from camcomp.model.config.doubt import Doubt
from camcomp.model.config.yaml_tree import Node, child

UNITS_MM = {"mm": 1.0, "inch": INCH_MM}
SAME_MM = 1e-3  # lengths that count as equal: tables have three decimals
_FORM = ("type", "corner_radius_mm", "point_deg")
_FILE_KEYS = ("file", "unit", "source")


@dataclass(frozen=True)
class ToolFile:
    """A tool table as bytes. unit_mm: mm per unit of length, for files that state none."""

    path: Path
    data: bytes
    unit_mm: float = 1.0

    @property
    def name(self) -> str:
        """The file in messages."""
        return display_name(self.path)

    def text(self) -> str:
        """The file as UTF-8 text. Raises ConfigError CC299."""
        try:
            return self.data.decode("utf-8-sig")
        except UnicodeDecodeError as error:
            line = self.data.count(b"\n", 0, error.start) + 1
            column = error.start - self.data.rfind(b"\n", 0, error.start)
            raise refused("the file is not UTF-8 text", Location(self.name, line, column)) from error


@dataclass(frozen=True, kw_only=True)
class TabledTool:
    """A tool of a table. number: its T word, None where the file states one tool without a number.

    keys: those of `tools:` in YAML, mm; length: its length offset, mm; why_open: why its form cannot be followed.
    """

    number: int | None
    at: Location
    keys: Mapping[str, Node] = field(default_factory=dict)
    length: Node | None = None
    why_open: str = ""


def refused(message: str, at: Location | None, hint: str | None = None) -> ConfigError:
    """The error of a table that cannot be used."""
    return ConfigError("CC299", message, at=at, hint=hint)


def with_tool_tables(tree: Node) -> tuple[Node, list[Doubt], list[CamcompError]]:
    """A machine file in which the tools of its tool tables stand under `tools:`, and their lengths under `control:`.

    Returns the tree, what in the tables contradicts it or cannot be followed, and what is wrong with them.
    """
    tools = child(tree, "tools")
    if tools is not None and isinstance(tools.value, str):
        tools = Node({"file": tools}, tools.at, tools.key_at)
    if tools is None or not isinstance(tools.value, dict):
        return tree, [], []
    own = {key: each for key, each in tools.value.items() if key not in _FILE_KEYS}
    found = _Found(child(child(tree, "tool") or tools, "teeth"))
    try:
        if named := child(tools, "file"):
            found.add_table(read_tools(named, child(tools, "unit")), own)
        elif unit := child(tools, "unit"):
            raise refused("a unit without a file", unit.key_at, "write tools: {file: tool.tbl, unit: inch}")
        for number, each in own.items():
            if (bit := child(each, "file")) is not None:
                found.add_bit(number, read_tools(bit, None), bit.at)
    except CamcompError as error:
        return replace(tree, value={**tree.value, "tools": replace(tools, value={})}), [], [error]
    merged = {**{n: Node(dict(each.keys), each.at) for n, each in found.tools.items()}, **own}
    for number, each in found.tools.items():
        if number in own:
            merged[number] = _over(own[number], each, number, found.doubts)
    values = {**tree.value, "tools": replace(tools, value=merged)}
    if found.lengths:
        values["control"] = _with_lengths(child(tree, "control"), found)
    return replace(tree, value=values), found.doubts, []


def read_tools(named: Node, unit: Node | None) -> list[TabledTool]:
    """The tools of the file that a node names, from its own folder. Raises ConfigError CC299, FileError at the node."""
    suffix = Path(str(named.value)).suffix.lower()
    known: dict[str, Any] = {each: reader for _, reader in shelf.usable("tool_tables") for each in reader.SUFFIXES}
    if not isinstance(named.value, str) or suffix not in known:
        raise refused(f"'{named.value}' is no tool table", named.at, f"camcomp reads {', '.join(sorted(known))}")
    reader = known[suffix]
    if unit is not None and unit.value not in UNITS_MM:
        raise refused(f"'{unit.value}' is no unit of a tool table", unit.at, f"write {' or '.join(UNITS_MM)}")
    if unit is not None and reader.STATES_UNIT:
        raise refused(f"{reader.TITLE} states its units itself", unit.at, "leave the unit out")
    path = Path(named.at.file).parent / named.value
    try:
        data = read_bytes(path)
    except CamcompError as error:
        error.at = error.at or named.at
        raise
    return list(reader.read(ToolFile(path, data, UNITS_MM[unit.value] if unit else 1.0)))


@dataclass
class _Found:
    """What tool tables state. teeth: of `tool:`, for tools whose table does not say."""

    teeth: Node | None
    tools: dict[int, TabledTool] = field(default_factory=dict)
    lengths: dict[int, Node] = field(default_factory=dict)
    doubts: list[Doubt] = field(default_factory=list)

    def add_table(self, listed: Iterable[TabledTool], own: Mapping[Any, Node]) -> None:
        """Tools with numbers; those in `own` may have a form that is not followed."""
        left_out: list[TabledTool] = []
        seen: dict[int, Location] = {}
        for each in listed:
            if each.number is None:
                hint = "name it where the number stands: tools: {1: {file: ...}}"
                raise refused("the file is one tool and states no T number", each.at, hint)
            if each.number in seen:
                raise refused(f"T{each.number} is there twice (first in line {seen[each.number].line})", each.at)
            seen[each.number] = each.at
            if each.why_open and each.number not in own:
                left_out.append(each)
            elif not each.why_open:
                self._add(each.number, each)
            if each.length is not None:
                self.lengths[each.number] = each.length
        if left_out:
            names = ", ".join(f"T{each.number} ({each.why_open})" for each in left_out)
            self.doubts.append(
                Doubt(f"{names}: the form cannot be followed; `tool:` counts where it cuts", left_out[0].at)
            )

    def add_bit(self, number: int, listed: Iterable[TabledTool], at: Location) -> None:
        """The one tool of a file without numbers."""
        only = [each for each in listed if each.number is None]
        if not only:
            raise refused("the file states tools by T number", at, "name it above the numbers: tools: {file: ...}")
        if only[0].why_open:
            raise refused(f"{only[0].why_open}: the form cannot be followed", only[0].at)
        self._add(number, only[0])

    def _add(self, number: int, tool: TabledTool) -> None:
        if not tool.keys:
            return  # a length alone
        teeth = {"teeth": self.teeth} if self.teeth is not None else {}
        self.tools[number] = replace(tool, keys={**teeth, **tool.keys})


def _over(own: Node, tool: TabledTool, number: int, doubts: list[Doubt]) -> Node:
    """A tool of the machine file, completed from the table."""
    if not isinstance(own.value, dict):
        return own
    stated = {key: each for key, each in own.value.items() if key != "file"}
    theirs = dict(tool.keys)
    for key in theirs.keys() & stated.keys() - {"teeth", "source"}:
        if _differ(stated[key].value, theirs[key].value):
            both = f"{_shown(theirs[key].value)} contradicts tools: {number}: {key} {_shown(stated[key].value)}"
            text = f"T{number} {key} {both}"
            doubts.append(Doubt(f"{text}, which counts", theirs[key].at))
    if "type" in stated and stated["type"].value != (theirs["type"].value if "type" in theirs else None):
        theirs = {key: each for key, each in theirs.items() if key not in _FORM}
    return replace(own, value={**theirs, **stated})


def _with_lengths(control: Node | None, found: _Found) -> Node:
    """The section `control` with the length offsets of tables under those that it states."""
    at = next(iter(found.lengths.values())).at
    control = control if control is not None and isinstance(control.value, dict) else Node({}, at)
    stated = child(control, "tool_lengths_mm")
    own = dict(stated.value) if stated is not None and isinstance(stated.value, dict) else {}
    for number, length in found.lengths.items():
        if number in own and _differ(own[number].value, length.value):
            here = f"control: tool_lengths_mm: {number}: {_shown(own[number].value)}"
            text = f"T{number} length {_shown(length.value)} mm contradicts {here}"
            found.doubts.append(Doubt(f"{text}, which counts", length.at))
    lengths = Node({**found.lengths, **own}, stated.at if stated else at, stated.key_at if stated else None)
    return replace(control, value={**control.value, "tool_lengths_mm": lengths})


def _shown(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


def _differ(one: Any, other: Any) -> bool:
    if isinstance(one, int | float) and isinstance(other, int | float):
        return abs(one - other) > SAME_MM
    return bool(one != other)
