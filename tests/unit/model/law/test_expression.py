"""Formulas out of files: what they mean, and that nothing but arithmetic can be said in them."""

import numpy as np
import pytest

from camcomp.model.law.expression import FormulaError, parse

NAMES = {"x_mm": "", "t_s": ""}


def value(text, **rows):
    arrays = {name: np.asarray(each, float) for name, each in rows.items()}
    return parse(text, NAMES)(arrays, len(next(iter(arrays.values()), [0.0])))


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("1 + 2*3", 7.0),
        ("-2^2", -4.0),
        ("2^3^2", 512.0),
        ("2^-1", 0.5),
        ("8/4/2", 1.0),
        ("(1 - 3)*-2", 4.0),
        ("1.5e-3*2", 0.003),
        ("cos(pi)", -1.0),
        ("max(2, min(5, 3)) + abs(-1)", 4.0),
        ("step(0) + sign(-3) + gauss(0) + tanh(0) + sqrt(4) + log(exp(1))", 4.0),
    ],
)
def test_arithmetic(text, expected):
    assert value(text, x_mm=[0.0]) == pytest.approx([expected])


def test_covariates_go_row_by_row():
    assert value("2*x_mm^2 - t_s", x_mm=[1.0, 2.0], t_s=[0.0, 1.0]) == pytest.approx([2.0, 7.0])


def test_what_remembers_goes_along_the_rows():
    there_and_back = [0.0, 1.0, 2.0, 1.0, 0.0]
    assert value("since(x_mm)", x_mm=there_and_back)[2:] == pytest.approx([1e9 + 2.0, 1.0, 2.0])
    assert value("way(x_mm, 0.01)", x_mm=there_and_back) == pytest.approx([0, 1, 1, -1, -1], abs=1e-6)
    assert value("drag(x_mm, 0.5)", x_mm=there_and_back) == pytest.approx([0, -0.25, -0.25, 0.25, 0.25])


def test_a_washout_of_a_ramp_is_the_step_response_of_a_lag():
    t = np.array([0.0, 0.1, 0.25, 0.3, 1.0])
    ramp = 0.2 * (1.0 - np.exp(-t / 0.2))  # s / (s + 1 / T) of t: T (1 - exp(-t / T))
    assert value("washout(x_mm, 0.2)", x_mm=t, t_s=t) == pytest.approx(ramp)
    assert value("washout(7, 0.2)", x_mm=t, t_s=t) == pytest.approx(np.zeros(5))


@pytest.mark.parametrize(
    ("text", "at"),
    [
        ("", 0),
        ("1 +", 3),
        ("1 2", 2),
        ("2*y_mm", 2),
        ("x_mm.real", 4),
        ("__import__('os')", 11),
        ("foo(x_mm)", 0),
        ("sin(1, 2)", 0),
        ("(x_mm", 5),
        ("1 + $", 4),
        ("x_mm**2", 5),
        ("way(x_mm, t_s)", 10),
        ("washout(x_mm, t_s)", 14),
        ("(" * 80 + "1" + ")" * 80, 31),
        ("1" + "+1" * 3000, 4000),
    ],
)
def test_what_is_no_formula_is_refused_where_it_goes_wrong(text, at):
    with pytest.raises(FormulaError) as error:
        parse(text, NAMES)
    assert error.value.at == at


def test_no_number_is_no_error_here():
    assert not np.isfinite(value("1/x_mm", x_mm=[0.0])).any()
