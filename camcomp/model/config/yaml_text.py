"""YAML 1.2 text as a tree: syntax, budgets, duplicate keys, by ruamel.yaml's parser."""

import re
from math import inf
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.composer import Composer
from ruamel.yaml.error import MarkedYAMLError
from ruamel.yaml.nodes import MappingNode, ScalarNode, SequenceNode
from ruamel.yaml.reader import ReaderError

from camcomp.ground.bounds import LARGEST_NUMBER
from camcomp.ground.errors import ConfigError, Location
from camcomp.ground.records import replace
from camcomp.model.config.yaml_tree import Node

_QUOTED_NUMBER = re.compile("0|[1-9][0-9]{0,8}")

# Budgets: a file written by hand has some hundred values; a file within them is read in about a second.
MOST_BYTES = 1 << 20
MOST_VALUES = 20_000  # an alias counts as often as it is used
DEEPEST = 50


def read_tree(data: bytes, name: str) -> tuple[Node | None, list[ConfigError]]:
    """The tree of one YAML document, or None, and all errors of its text.

    Errors of syntax, encoding, budgets, duplicate keys, unknown tags and empty documents are returned, not raised.
    """
    if len(data) > MOST_BYTES:
        return None, [ConfigError("CC217", f"more than {MOST_BYTES} bytes", at=Location(name, 1, 1))]
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        column = error.start - data.rfind(b"\n", 0, error.start)
        at = Location(name, line, column)
        return None, [ConfigError("CC200", "the file is not UTF-8 text", at=at, hint="save it as UTF-8")]
    builder = _Builder(name, text.splitlines())
    try:
        yaml = YAML(typ="safe", pure=True)
        yaml.Composer = _Composer
        root = yaml.compose(text)
    except _BeyondBudget as error:
        return None, [ConfigError("CC217", str(error), at=builder.place(error.line, error.column))]
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        at = builder.place(mark.line, mark.column) if mark else Location(name, 1, 1)
        rule = "CC210" if at.source[at.column - 1 : at.column] == "\t" else "CC200"
        problem = "tab in the indentation" if rule == "CC210" else (error.problem or error.context or "not YAML")
        context = f" ({error.context})" if error.problem and error.context and rule == "CC200" else ""
        return None, [ConfigError(rule, f"{problem}{context}", at=at)]
    except ReaderError as error:
        before = text[: error.position]
        at = builder.place(before.count("\n"), error.position - before.rfind("\n") - 1)
        return None, [ConfigError("CC200", f"character {ord(text[error.position]):#x} is not allowed", at=at)]
    except RecursionError:
        return None, [ConfigError("CC200", "nested too deeply", at=Location(name, 1, 1))]
    if root is None:
        return None, [ConfigError("CC211", "the file is empty", at=Location(name, 1, 1))]
    try:
        tree = builder.build(root)
    except _BeyondBudget as error:
        return None, [ConfigError("CC217", str(error), at=builder.place(error.line, error.column))]
    return tree, builder.errors


class _BeyondBudget(Exception):
    """A file exceeds the budgets of a machine file."""

    def __init__(self, what: str, mark: Any) -> None:
        super().__init__(what)
        self.line, self.column = mark.line, mark.column


class _Composer(Composer):
    """Composer of ruamel that stops at the budgets."""

    values = level = 0

    def __init__(self, loader: Any = None) -> None:
        super().__init__(loader)
        self.warn_double_anchors = False  # YAML allows them

    def compose_node(self, parent: Any, index: Any) -> Any:
        """Compose a node with its children."""
        self.values += 1
        self.level += 1
        if self.values > MOST_VALUES:
            raise _BeyondBudget(f"more than {MOST_VALUES} values", self.parser.peek_event().start_mark)
        if self.level > DEEPEST:
            raise _BeyondBudget("nested too deeply", self.parser.peek_event().start_mark)
        try:
            return super().compose_node(parent, index)
        finally:
            self.level -= 1


class _Builder:
    """Convert ruamel's composed nodes to Nodes and collect their errors."""

    def __init__(self, name: str, lines: list[str]) -> None:
        self.name = name
        self.lines = lines
        self.errors: list[ConfigError] = []
        self.open: list[Any] = []  # collections being built, outermost first
        self.values = 0

    def place(self, line: int, column: int) -> Location:
        source = self.lines[line] if line < len(self.lines) else ""
        return Location(self.name, line + 1, column + 1, source)

    def build(self, node: Any) -> Node:
        at = self.place(node.start_mark.line, node.start_mark.column)
        self.values += 1
        if self.values > MOST_VALUES:
            raise _BeyondBudget(f"more than {MOST_VALUES} values, each alias counted where it is used", node.start_mark)
        if isinstance(node, ScalarNode):
            return Node(self._scalar(node, at), at)
        if any(each is node for each in self.open):
            self.errors.append(ConfigError("CC200", "an anchor contains itself", at=at))
            return Node(None, at)
        self.open.append(node)
        try:
            if isinstance(node, MappingNode):
                return Node(self._mapping(node), at)
            assert isinstance(node, SequenceNode)
            return Node([self.build(each) for each in node.value], at)
        finally:
            self.open.pop()

    def _mapping(self, node: MappingNode) -> dict[Any, Node]:
        own: dict[Any, Node] = {}
        merged: dict[Any, Node] = {}
        for key_node, value_node in node.value:
            key = self.build(key_node)
            if isinstance(key.value, list | dict):
                self.errors.append(ConfigError("CC200", "a key has to be a single word or number", at=key.at))
                continue
            if isinstance(key.value, str) and _QUOTED_NUMBER.fullmatch(key.value):
                key = replace(key, value=int(key.value))  # JSON has no other keys than strings
            value = replace(self.build(value_node), key_at=key.at)
            if isinstance(value_node, ScalarNode) and not value_node.value:
                value = replace(value, at=key.at)  # nothing after the colon: the mark is lines further down
            if key.value == "<<" and key_node.style is None:
                for base in value.value if isinstance(value.value, list) else [value]:
                    if isinstance(base.value, dict):
                        merged = {**base.value, **merged}
                    else:
                        self.errors.append(ConfigError("CC204", "`<<` merges mappings only", at=base.at))
            elif key.value in own:
                first = own[key.value].key_at
                line = f" (first in line {first.line})" if first else ""
                self.errors.append(ConfigError("CC207", f"key '{key.value}' is given twice{line}", at=key.at))
            else:
                own[key.value] = value
        return {**merged, **own}

    def _scalar(self, node: ScalarNode, at: Location) -> Any:
        kind = str(node.tag).removeprefix("tag:yaml.org,2002:")
        text = node.value
        if any(each == "\0" or "\ud800" <= each <= "\udfff" for each in text):
            self.errors.append(ConfigError("CC200", "a zero byte or half a character is no text", at=at))
            return None
        try:
            if kind == "null":
                return None
            if kind == "bool":
                return text.lower() == "true"
            if kind == "int":
                digits = text.replace("_", "")
                return self._bounded(
                    int(digits, 0) if digits.lstrip("+-")[:2].lower() in ("0x", "0o", "0b") else int(digits), at
                )
            if kind == "float":
                word = text.replace("_", "").lower()
                return self._bounded(
                    float(word.replace(".inf", "inf") if "inf" in word else word.replace(".nan", "nan")), at
                )
        except ValueError:
            self.errors.append(ConfigError("CC204", f"'{text[:40]}' is not a number", at=at))
            return None
        if kind not in ("str", "timestamp", "value", "merge"):
            self.errors.append(ConfigError("CC200", f"tags such as {kind} are not used here", at=at))
        return text

    def _bounded(self, value: float, at: Location) -> float:
        """The value, with an error if it is implausibly large; infinity is refused by the spec."""
        if LARGEST_NUMBER < abs(value) < inf:
            message = f"the number is larger than {LARGEST_NUMBER:g}, beyond every machine"
            self.errors.append(ConfigError("CC205", message, at=at))
            return LARGEST_NUMBER if value > 0 else -LARGEST_NUMBER
        return value
