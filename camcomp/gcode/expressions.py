"""Expressions and parameters of programs: parsed once, evaluated exactly as by the controller, or refused.

Two spellings: `#1`, `#<name>`, `[...]` of RS274 and Fanuc, and `R1`, `(...)` of Sinumerik.
"""

import math
from typing import Any, NoReturn

from camcomp.gcode.spelling import FANUC, RS274, Spelling


class ExpressionError(Exception):
    """Message and character of an error in an expression; the reader adds the line."""

    def __init__(self, message: str, column: int) -> None:
        super().__init__(message)
        self.message = message
        self.column = column


# A parsed expression: ("number", x), ("parameter", e), ("name", s), ("call", f, e), ("atan", a, b), ("exists", e),
# ("negative", e), ("operator", symbol, a, b). Each is a tuple whose last item is the column, for messages.
Expression = tuple[Any, ...]


_DEEPEST = 100  # values in one expression


class Parser:
    """Recursive descent over one line; `at` is the next character."""

    def __init__(self, line: str, at: int, spelling: Spelling) -> None:
        self.line, self.at, self.spelling = line, at, spelling
        self.depth = 0

    def fail(self, message: str) -> NoReturn:
        """Raise ExpressionError here."""
        raise ExpressionError(message, min(self.at, max(len(self.line) - 1, 0)))

    def blank(self) -> str:
        """Skip blanks, and return the next character in upper case, or an empty string at the end."""
        while self.at < len(self.line) and self.line[self.at] in " \t":
            self.at += 1
        return self.line[self.at : self.at + 1].upper()

    def behind(self) -> int:
        """Index behind the last character read, before the blanks skipped after it."""
        at = self.at
        while at > 0 and self.line[at - 1] in " \t":
            at -= 1
        return at

    def value(self) -> Expression:
        """A value behind a letter: a number, a parameter, a function, a group, with a sign."""
        char, column = self.blank(), self.at
        self.depth += 1
        if self.depth > _DEEPEST:
            self.fail("the expression is too long")
        if char in ("-", "+") and char:
            self.at += 1
            inner = self.value()
            return ("negative", inner, column) if char == "-" else inner
        if char.isdigit() or char == ".":
            return self.number()
        if char == self.spelling.opening:
            return self.group()
        if char == self.spelling.sigil and (char == "#" or self._next_is_digit()):
            return self.parameter()
        if char.isalpha():
            return self.function()
        return self.fail("an expression is not complete")

    def _next_is_digit(self) -> bool:
        return self.line[self.at + 1 : self.at + 2].isdigit()

    def number(self) -> Expression:
        """An unsigned number."""
        start = self.at
        points = 0
        while self.at < len(self.line) and (self.line[self.at].isdigit() or self.line[self.at] == "."):
            points += self.line[self.at] == "."
            self.at += 1
        text = self.line[start : self.at]
        if points > 1 or text == "." or not text.isascii():
            self.at = start
            self.fail(f"'{text}' is not a number")
        if self.spelling.sigil == "#" and self.line[self.at : self.at + 1] == ",":
            self.fail("decimal comma")
        return ("number", float(text), start)

    def group(self) -> Expression:
        """A whole expression in brackets."""
        if self.blank() != self.spelling.opening:
            self.fail(f"'{self.spelling.opening}' is missing")
        self.at += 1
        inner = self.expression(0)
        if self.blank() != self.spelling.closing:
            self.fail(f"'{self.spelling.closing}' is missing")
        self.at += 1
        return inner

    def parameter(self) -> Expression:
        """`#1`, `##1`, `#[...]`, `#<name>` or `R1`."""
        column = self.at
        self.at += 1
        char = self.blank()
        if char == "<" and self.spelling.named:
            close = self.line.find(">", self.at)
            if close < 0:
                self.fail("'>' is missing")
            name = "".join(self.line[self.at + 1 : close].split()).lower()
            self.at = close + 1
            return ("name", name, column)
        if char.isdigit():
            return ("parameter", self.number(), column)
        if char == "#":
            return ("parameter", self.value(), column)
        if char.isalpha() and self.spelling.named:
            return ("parameter", self.function(), column)
        return ("parameter", self.group(), column)

    def function(self) -> Expression:
        """`SIN[...]`, `ATAN[...]/[...]`, `EXISTS[#<name>]`."""
        start = self.at
        while self.at < len(self.line) and self.line[self.at].isalpha():
            self.at += 1
        name = self.line[start : self.at].upper()
        if self.spelling.sigil == "R" and name in ("ATAN", "POT") and self.line[self.at : self.at + 1] == "2":
            self.at += 1
            name += "2"
        if name == "ATAN2":
            return self._atan2(start)
        if name == "EXISTS" and self.spelling.named:
            self.blank()
            inner = self.group()
            return ("exists", inner, start)
        if name not in self.spelling.functions:
            self.at = start
            self.fail(f"'{name}' is not a function that camcomp knows")
        inner = self.group()
        if name == "ATAN" and self.spelling.sigil == "#":
            if self.blank() != "/":
                if self.spelling is RS274:
                    self.fail("ATAN needs two groups: ATAN[y]/[x]")
                return ("call", name, inner, start)
            self.at += 1
            return ("atan", inner, self.group(), start)
        return ("call", name, inner, start)

    def _atan2(self, start: int) -> Expression:
        if self.blank() != "(":
            self.fail("'(' is missing")
        self.at += 1
        first = self.expression(0)
        if self.blank() != ",":
            self.fail("ATAN2 needs two values")
        self.at += 1
        second = self.expression(0)
        if self.blank() != ")":
            self.fail("')' is missing")
        self.at += 1
        return ("atan", first, second, start)

    def expression(self, level: int) -> Expression:
        """Operators from `level` upwards; those of one level associate in reading order."""
        if level == len(self.spelling.operators):
            return self.value()
        left = self.expression(level + 1)
        while True:
            symbol = self._operator(level)
            if symbol is None:
                return left
            left = ("operator", symbol, left, self.expression(level + 1), self.at)

    def _operator(self, level: int) -> str | None:
        self.blank()
        rest = self.line[self.at : self.at + 3].upper()
        for symbol in self.spelling.operators[level]:
            if rest.startswith(symbol) and not (symbol == "*" and rest.startswith("**")):
                self.at += len(symbol)
                return symbol
        return None


class Memory:
    """Values that an expression can read; the interpreter provides them from its state."""

    def parameter(self, number: int) -> float:
        """Value of `#number`."""
        raise NotImplementedError

    def named(self, name: str) -> float | None:
        """Value of `#<name>`, None before it is set."""
        raise NotImplementedError

    def exists(self, expression: Expression) -> bool:
        """Whether a parameter was set."""
        raise NotImplementedError


def evaluate(expression: Expression, memory: Memory, spelling: Spelling) -> float:
    """Value of an expression. Raises ExpressionError for an undefined one."""
    kind, column = expression[0], expression[-1]
    if kind == "number":
        return float(expression[1])
    if kind == "negative":
        return -evaluate(expression[1], memory, spelling)
    if kind == "parameter":
        return memory.parameter(index_of(expression[1], memory, spelling, column))
    if kind == "name":
        value = memory.named(expression[1])
        if value is None:
            raise ExpressionError(f"parameter <{expression[1]}> is not set", column)
        return value
    if kind == "exists":
        return 1.0 if memory.exists(expression[1]) else 0.0
    if kind == "operator":
        left = evaluate(expression[2], memory, spelling)
        right = evaluate(expression[3], memory, spelling)
        result = _operate(expression[1], left, right, column, spelling)
        if not math.isfinite(result):
            raise ExpressionError(f"{expression[1]} has no value there", column)
        return result
    try:
        if kind == "atan":
            y, x = evaluate(expression[1], memory, spelling), evaluate(expression[2], memory, spelling)
            return math.degrees(math.atan2(y, x))
        argument = evaluate(expression[2], memory, spelling)
        result = float(spelling.functions[expression[1]](0.0 if math.isnan(argument) else argument))
    except (ValueError, OverflowError):
        raise ExpressionError(f"{expression[1]} has no value there", column) from None
    return result


def index_of(expression: Expression, memory: Memory, spelling: Spelling, column: int) -> int:
    """Number of a parameter, a whole one."""
    value = evaluate(expression, memory, spelling)
    if not math.isfinite(value) or abs(value - round(value)) > 1e-4:
        raise ExpressionError("a parameter number is a whole number", column)
    return round(value)


_EQUAL = 1e-4  # tolerance of LinuxCNC for equal numbers


def _operate(symbol: str, a: float, b: float, column: int, spelling: Spelling) -> float:
    if spelling is FANUC and (math.isnan(a) or math.isnan(b)):
        # A vacant variable equals a vacant one only; in all other operations it is zero.
        if symbol in ("EQ", "NE"):
            return float((math.isnan(a) and math.isnan(b)) == (symbol == "EQ"))
        a, b = (0.0 if math.isnan(each) else each for each in (a, b))
    same = abs(a - b) < _EQUAL if spelling is RS274 else a == b
    compare = {
        "EQ": same,
        "==": same,
        "NE": not same,
        "<>": not same,
        "GT": a > b,
        ">": a > b,
        "GE": a >= b,
        ">=": a >= b,
        "LT": a < b,
        "<": a < b,
        "LE": a <= b,
        "<=": a <= b,
    }
    if symbol in compare:
        return float(compare[symbol])
    if symbol in ("AND", "OR", "XOR"):
        if spelling is FANUC:
            raise ExpressionError(f"{symbol} works on bits there, and camcomp does not follow that", column)
        x, y = a != 0.0, b != 0.0
        return float((x and y) if symbol == "AND" else (x or y) if symbol == "OR" else x != y)
    try:
        if symbol == "+":
            return a + b
        if symbol == "-":
            return a - b
        if symbol == "*":
            return a * b
        if symbol == "**":
            result = a**b
            if isinstance(result, complex):
                raise ValueError
            out: float = result
            return out
        if b == 0.0:
            raise ExpressionError("division by zero", column)
        if symbol == "/":
            return a / b
        if symbol == "DIV":
            return float(math.trunc(a / b))
        rest = math.fmod(a, b)
        # LinuxCNC keeps the result of MOD positive.
        return rest + abs(b) if rest < 0.0 and spelling is RS274 else rest
    except (ValueError, OverflowError, ZeroDivisionError):
        raise ExpressionError(f"{symbol} has no value there", column) from None


def parameters_of(expression: Expression) -> list[Expression]:
    """Expressions behind the sigil of every parameter in an expression, without columns."""
    found = [expression[1][:2]] if expression[0] == "parameter" else []
    for each in expression[1:-1]:
        if isinstance(each, tuple):
            found += parameters_of(each)
    return found
