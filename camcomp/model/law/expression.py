"""Formulas as text: a small grammar of numbers, covariates and functions, read into a tree and evaluated over rows.

    sum     = product (("+" | "-") product)*
    product = sign (("*" | "/") sign)*
    sign    = ("+" | "-") sign | power
    power   = atom ("^" sign)?
    atom    = number | name | name "(" sum ("," sum)* ")" | "(" sum ")"

The grammar has no other constructs, so a formula from a file can only compute.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from difflib import get_close_matches

import numpy as np

from camcomp.ground.datatypes import Floats
from camcomp.ground.records import dataclass
from camcomp.model.hysteresis import direction, first_order, play

LONGEST = 4000  # characters
DEEPEST = 60  # nested brackets and signs
_TOKEN = re.compile(r"\s*(?:(\d+\.?\d*(?:[eE][+-]?\d+)?|\.\d+(?:[eE][+-]?\d+)?)|([A-Za-z_]\w*)|([-+*/^(),]))")
CONSTANTS = {"pi": float(np.pi)}


class FormulaError(ValueError):
    """An error in a formula, with the index of its character, from 0."""

    def __init__(self, message: str, at: int, hint: str = "") -> None:
        super().__init__(message)
        self.at, self.hint = at, hint


def way(u: Floats, length: float) -> Floats:
    """Direction (n,) in which u (n,) travels, -1 to 1; a reversal changes it over a travel of `length`."""
    return direction(u[:, None], max(length, 1e-9))[:, 0]


def drag(u: Floats, width: float) -> Floats:
    """Output minus input (n,) of a play of full `width` driven by u (n,): -width/2 to width/2."""
    return play(u[:, None], max(width, 0.0))[:, 0]


def since(u: Floats) -> Floats:
    """Travel (n,) of u (n,) since its last reversal; 1e9 before the first one."""
    step = np.diff(u, prepend=u[:1])
    gone = np.cumsum(np.abs(step))
    sense = np.sign(step)
    moving = np.flatnonzero(sense)
    last = np.full(len(u), -1e9)
    turned = moving[1:][sense[moving[1:]] != sense[moving[:-1]]]
    last[turned] = gone[turned - 1]
    return np.asarray(gone - np.maximum.accumulate(last))


def washout(time: Floats, u: Floats, constant: float) -> Floats:
    """High-pass of u (n,) or (n, q) at times (n,) s: every change fades with a time constant, s; 0 at the start."""
    u = np.broadcast_to(u, (len(time), *u.shape[1:]))
    return np.asarray(u - first_order(u.reshape(len(time), -1), time, max(constant, 1e-9)).reshape(u.shape))


# name -> (number of arguments, function, description)
FUNCTIONS: dict[str, tuple[int, Callable[..., Floats], str]] = {
    "sin": (1, np.sin, "sine of rad"),
    "cos": (1, np.cos, "cosine of rad"),
    "exp": (1, np.exp, "exponential"),
    "log": (1, np.log, "natural logarithm"),
    "sqrt": (1, np.sqrt, "square root"),
    "abs": (1, np.abs, "size without sign"),
    "sign": (1, np.sign, "-1, 0 or 1"),
    "tanh": (1, np.tanh, "hyperbolic tangent"),
    "step": (1, lambda u: np.where(u >= 0.0, 1.0, 0.0), "0 below 0, else 1"),
    "gauss": (1, lambda u: np.exp(-(np.minimum(np.abs(u), 1e3) ** 2)), "exp(-u^2)"),
    "min": (2, np.minimum, "the smaller one"),
    "max": (2, np.maximum, "the larger one"),
    "way": (2, way, "sense of travel, -1 to 1, that a reversal turns round over a length"),
    "drag": (2, drag, "what a play of a full width takes away"),
    "since": (1, since, "way since the last reversal"),
    "washout": (2, washout, "what is left of a value whose changes fade with a time constant in s"),
}
_BY_TIME = {"washout"}  # of a run
_BY_NUMBER = {"way", "drag", *_BY_TIME}  # their second argument is one number
_OF_ROWS_IN_ORDER = {*_BY_NUMBER, "since"}


@dataclass(frozen=True)
class FormulaNode:
    """A number, a name, or an operation on parts; `at`: index of its first character."""

    kind: str  # "number", "name", "call", or the operator
    value: float | str
    parts: tuple[FormulaNode, ...] = ()
    at: int = 0

    def walk(self) -> Iterator[FormulaNode]:
        """This node and all below it."""
        yield self
        for part in self.parts:
            yield from part.walk()


@dataclass(frozen=True)
class Expression:
    """A formula: its text and its tree."""

    text: str
    root: FormulaNode

    @property
    def names(self) -> tuple[str, ...]:
        """The covariates in it, each once, in order."""
        return tuple(dict.fromkeys(str(each.value) for each in self.root.walk() if each.kind == "name"))

    @property
    def remembers(self) -> bool:
        """Whether a value depends on the rows before it, which then have to belong to one run."""
        return any(each.kind == "call" and each.value in _OF_ROWS_IN_ORDER for each in self.root.walk())

    def __call__(self, rows: Mapping[str, Floats], n: int) -> Floats:
        """Values (n,) for covariates with n rows; NaN or infinite where the formula is undefined."""
        with np.errstate(all="ignore"):
            return np.array(np.broadcast_to(_value(self.root, rows), (n,)), float)


def parse(text: str, names: Mapping[str, object]) -> Expression:
    """Parse a formula; `names` are the allowed covariates. Raises FormulaError."""
    if len(text) > LONGEST:
        raise FormulaError(f"longer than {LONGEST} characters", LONGEST)
    reader = _Reader(text)
    if not reader.tokens:
        raise FormulaError("the formula is empty", 0)
    root = reader.sum(0)
    reader.expect_end()
    for node in root.walk():
        if node.kind == "name" and node.value not in names:
            raise FormulaError(f"'{node.value}' is not known", node.at, _hint(str(node.value), list(names)))
    return Expression(text, root)


def _hint(name: str, known: list[str]) -> str:
    close = get_close_matches(name, known, n=1)
    return (f"did you mean '{close[0]}'? " if close else "") + f"known here: {', '.join(known)}"


class _Reader:
    """Recursive descent over the tokens of one formula."""

    def __init__(self, text: str) -> None:
        self.tokens: list[tuple[str, str, int]] = []
        at, end = 0, len(text.rstrip())
        while at < end:
            found = _TOKEN.match(text, at)
            if found is None:
                at += len(text[at:]) - len(text[at:].lstrip())
                raise FormulaError(f"'{text[at]}' has no meaning in a formula", at)
            kind = "number" if found[1] else "name" if found[2] else "sign"
            self.tokens.append((kind, found[found.lastindex or 0], found.start(found.lastindex or 0)))
            at = found.end()
        self.next, self.end = 0, end

    def peek(self) -> str:
        return self.tokens[self.next][1] if self.next < len(self.tokens) else ""

    def place(self) -> int:
        return self.tokens[self.next][2] if self.next < len(self.tokens) else self.end

    def take(self, *texts: str) -> str:
        """The next token if it is one of these."""
        if self.next < len(self.tokens) and self.tokens[self.next][0] == "sign" and self.peek() in texts:
            self.next += 1
            return self.tokens[self.next - 1][1]
        return ""

    def expect(self, text: str) -> None:
        if not self.take(text):
            raise FormulaError(f"'{text}' is missing", self.place())

    def expect_end(self) -> None:
        if self.next < len(self.tokens):
            raise FormulaError(f"'{self.peek()}' does not fit here", self.place())

    def sum(self, depth: int) -> FormulaNode:
        left = self.product(depth)
        while sign := self.take("+", "-"):
            left = FormulaNode(sign, "", (left, self.product(depth)), left.at)
        return left

    def product(self, depth: int) -> FormulaNode:
        left = self.sign(depth)
        while sign := self.take("*", "/"):
            left = FormulaNode(sign, "", (left, self.sign(depth)), left.at)
        return left

    def sign(self, depth: int) -> FormulaNode:
        if depth > DEEPEST:
            raise FormulaError("nested too deeply", self.place())
        at = self.place()
        if sign := self.take("+", "-"):
            inner = self.sign(depth + 1)
            return inner if sign == "+" else FormulaNode("neg", "", (inner,), at)
        base = self.atom(depth + 1)
        return FormulaNode("^", "", (base, self.sign(depth + 1)), at) if self.take("^") else base

    def atom(self, depth: int) -> FormulaNode:
        at = self.place()
        if self.take("("):
            inner = self.sum(depth + 1)
            self.expect(")")
            return inner
        if self.next >= len(self.tokens):
            raise FormulaError("the formula ends where a number or a name is due", at)
        kind, text, _ = self.tokens[self.next]
        if kind == "sign":
            raise FormulaError(f"'{text}' stands where a number or a name is due", at)
        self.next += 1
        if kind == "number":
            return FormulaNode("number", float(text), (), at)
        if self.take("("):
            return self.call(text, at, depth)
        return (
            FormulaNode("number", CONSTANTS[text], (), at) if text in CONSTANTS else FormulaNode("name", text, (), at)
        )

    def call(self, name: str, at: int, depth: int) -> FormulaNode:
        if name not in FUNCTIONS:
            raise FormulaError(f"there is no function '{name}'", at, _hint(name, list(FUNCTIONS)))
        parts = [self.sum(depth + 1)]
        while self.take(","):
            parts.append(self.sum(depth + 1))
        self.expect(")")
        if len(parts) != FUNCTIONS[name][0]:
            raise FormulaError(f"{name} takes {FUNCTIONS[name][0]} argument(s), not {len(parts)}", at)
        if name in _BY_NUMBER and any(each.kind == "name" for each in parts[1].walk()):
            raise FormulaError(f"the second argument of {name} is one number", parts[1].at)
        return FormulaNode("call", name, tuple(parts), at)


def _value(node: FormulaNode, rows: Mapping[str, Floats]) -> Floats:
    if node.kind == "number":
        return np.asarray(float(node.value))
    if node.kind == "name":
        return rows[str(node.value)]
    parts = [_value(each, rows) for each in node.parts]
    if node.kind == "call":
        name = str(node.value)
        if name in _OF_ROWS_IN_ORDER:
            first = np.atleast_1d(np.asarray(parts[0], float))
            more = [float(each) for each in parts[1:]]
            return FUNCTIONS[name][1](*(rows["t_s"],) if name in _BY_TIME else (), first, *more)
        return np.asarray(FUNCTIONS[name][1](*parts))
    if node.kind == "neg":
        return np.asarray(-parts[0])
    a, b = parts
    operation = {"+": np.add, "-": np.subtract, "*": np.multiply, "/": np.divide, "^": np.power}[node.kind]
    return np.asarray(operation(a, b))
