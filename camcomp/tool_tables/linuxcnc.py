"""LinuxCNC's `tool.tbl`: `T1 P1 Z+87.4 D8 ;comment`; Z is the length offset of G43, D the diameter, in machine units.

Source: LinuxCNC user manual, "Tool Table File Format". Orientation (Q) and edge angles (I, J) are those of turning tools.
"""

import re
from collections.abc import Iterator

from camcomp.ground.bounds import number_of
from camcomp.ground.errors import Location
from camcomp.model.config.tool_table import TabledTool, ToolFile, refused
from camcomp.model.config.yaml_tree import Node

TITLE = "LinuxCNC tool table (tool.tbl)"
SUFFIXES = (".tbl",)
STATES_UNIT = False
_LETTERS = "TPXYZABCUVWDIJQ"
_TURNING = "IJQ"
_WORD = re.compile(r"\S+")


def read(file: ToolFile) -> Iterator[TabledTool]:
    """The tools line by line; lines of a comment alone are passed over."""
    for k, line in enumerate(file.text().splitlines()):
        words = list(_WORD.finditer(line.partition(";")[0]))
        if words and [each[0].upper() for each in words[:2]] == ["POC", "FMS"]:
            at = Location(file.name, k + 1, 1, line)
            raise refused("a tool table of LinuxCNC 2.3 or older", at, "write one line per tool: T1 P1 Z87.4 D8")
        if words:
            yield _tool(file, line, k + 1, words)


def _tool(file: ToolFile, line: str, count: int, words: list[re.Match[str]]) -> TabledTool:
    values: dict[str, Node] = {}
    for word in words:
        at = Location(file.name, count, word.start() + 1, line)
        letter, value = word[0][0].upper(), number_of(word[0][1:])
        if letter not in _LETTERS or value is None or not abs(value) < float("inf"):
            raise refused(f"'{word[0]}' is no word of a tool table", at, "a line reads like T1 P1 Z87.4 D8 ;comment")
        if letter in values:
            raise refused(f"{letter} is there twice in one line", at)
        values[letter] = Node(value, at)
    at = Location(file.name, count, words[0].start() + 1, line)
    number = values.get("T")
    if number is None or number.value != int(number.value) or not number.value >= 0:
        raise refused("the line states no tool number", number.at if number else at, "it begins with T and the number")
    keys = {"diameter_mm": _mm(values["D"], file)} if "D" in values and values["D"].value != 0.0 else {}
    length = _mm(values["Z"], file) if "Z" in values else None
    turning = any(letter in values and values[letter].value != 0.0 for letter in _TURNING)
    return TabledTool(
        number=int(number.value), at=at, keys=keys, length=length, why_open="turning tool" if turning else ""
    )


def _mm(given: Node, file: ToolFile) -> Node:
    return Node(round(given.value * file.unit_mm, 9), given.at)
