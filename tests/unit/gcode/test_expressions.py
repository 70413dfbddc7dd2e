"""Expressions as LinuxCNC, Fanuc and Sinumerik compute them; the values of RS274 were read off LinuxCNC 2.9."""

import math

import pytest

from camcomp.gcode.expressions import ExpressionError, Memory, Parser, evaluate
from camcomp.gcode.spelling import FANUC, RS274, SINUMERIK


class Store(Memory):
    def __init__(self, **values):
        self.values = {1: 2.0, 2: 7.0, 31: 0.0}

    def parameter(self, number):
        return self.values.get(number, math.nan)

    def named(self, name):
        return {"a": 3.0}.get(name)

    def exists(self, expression):
        return expression[0] == "name" and expression[1] == "a"


def value(text, spelling=RS274, whole=False):
    parser = Parser(text, 0, spelling)
    found = parser.expression(0) if whole else parser.value()
    assert parser.blank() == ""
    return evaluate(found, Store(), spelling)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("[-7 MOD 3]", 2), ("[7 MOD -3]", 1), ("[-7 MOD -3]", 2), ("ROUND[-2.5]", -3), ("ROUND[2.5]", 3),
        ("FIX[-2.3]", -3), ("FUP[-2.3]", -2), ("[2**3**2]", 64), ("[1+2*3-4/2]", 5), ("[1 OR 0 AND 0]", 0),
        ("[2 EQ 2.00009]", 1), ("[2 EQ 2.00011]", 0), ("-SIN[30]", -0.5), ("-#1", -2), ("ATAN[1]/[-1]", 135),
        ("[1 LT 2 EQ 1]", 1), ("[5 - 3 - 1]", 1), ("[-2**2]", 4), ("[1 XOR 1]", 0), ("##1", 7), ("#[1+1]", 7),
        ("[2 * -3]", -6), ("ACOS[0.5]", 60), ("#<a>", 3), ("#< A >", 3), ("EXISTS[#<a>]", 1), ("EXISTS[#<b>]", 0),
        ("[1.00005 GT 1]", 1), ("[1 GE 1.00005]", 0), ("+#1", 2), ("sqrt[4]", 2), ("#ATAN[1]/[1]", math.nan),
    ],
)  # fmt: skip
def test_rs274(text, expected):
    assert value(text) == pytest.approx(expected, abs=1e-9, nan_ok=True)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("#1+#2*2", 16), ("#9+1", 1), ("[#9EQ#0]", 1), ("[#9EQ0]", 0), ("[#9NE#0]", 0), ("[#9GE0]", 1),
        ("FIX[-2.3]", -2), ("ATAN[1]/[1]", 45), ("SIN[30.]*2", 1), ("10/4", 2.5), ("-#1-1", -3),
    ],
)  # fmt: skip
def test_fanuc(text, expected):
    assert value(text, FANUC, whole=True) == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize(
    ("text", "expected"),
    [("R1*2+SIN(30)", 4.5), ("(R1+R2)/3", 3), ("7 DIV 2", 3), ("7 MOD 4", 3), ("ATAN2(1,1)", 45), ("-(R1-2)", 0)]
    + [("POT(3)", 9), ("1 <> 2", 1), ("2 == 2 AND 3 > 4", 0)],
)
def test_sinumerik(text, expected):
    assert value(text, SINUMERIK, whole=True) == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize(
    "text", ["[1", "[1+]", "#<b>", "[1/0]", "SQRT[-1]", "LN[0]", "[0**-1]", "ATAN[1]", "FOO[1]", "#", "[1 2]", "[1e400]"]
    + ["[10**400]", "[[-8]**0.5]", "#[1.5]", "1,5", "[1,5]"]
)  # fmt: skip
def test_refused(text):
    with pytest.raises((ExpressionError, AssertionError)):
        value(text)
