"""Circles of a report: what is found in the runs and drawn of it, and the circular deviation against closed forms."""

import dataclasses

import numpy as np
import pytest

from camcomp.diagnosis.circles import OUTWARD
from camcomp.diagnosis.report.circles import circles_of, circles_section
from camcomp.diagnosis.report.run_view import RunView
from camcomp.diagnosis.result.standards import CircularTest, CircularTurn
from camcomp.diagnosis.statistics.standard_values import circular_deviation
from camcomp.gcode.interpret import read_program

CIRCLE = "G21 G90 G17\nF1000\nG0 X25 Y0 Z0\n{way} X25 Y0 I-25 J0\n{way} X25 Y0 I-25 J0\nM2\n"
ANGLES = np.linspace(0.0, 4 * np.pi, 1441)


def view(name, *, clockwise, radial, rows=1441, cutting=False):
    """A circle of 25 mm driven twice; radial: angle -> radial gap, um."""
    told = np.linspace(0.0, 4 * np.pi, rows) * (-1.0 if clockwise else 1.0)
    at = np.column_stack((25 * np.cos(told), 25 * np.sin(told), np.zeros(rows)))
    gap = radial(told)[:, None] * np.column_stack((np.cos(told), np.sin(told), np.zeros(rows)))
    program = read_program(CIRCLE.format(way="G2" if clockwise else "G3").encode(), name="c").path
    return RunView(
        name=name,
        held_out=False,
        time=np.abs(told),
        position=at,
        before=gap,
        after=0.0 * gap,
        channels=("tip x", "tip y", "tip z"),
        commanded=at,
        program=program,
        cutting=cutting,
    )


def test_a_ring_of_points_about_any_centre_has_no_deviation():
    assert circular_deviation([25.0 * OUTWARD + [0.3, -0.2]]) == pytest.approx(0.0, abs=1e-9)


def test_an_oval_deviates_by_twice_its_amplitude():
    """r = R + a cos(2 angle): least-squares centre in the middle, radii from R - a to R + a."""
    angle = np.radians(np.arange(360) + 0.5)
    assert circular_deviation([(25.0 + 0.01 * np.cos(2 * angle))[:, None] * OUTWARD]) == pytest.approx(0.020, rel=2e-3)


def test_half_a_circle_too_large_deviates_about_its_own_centre():
    """r = R + a on one half: the least-squares centre moves by 2 a / pi, the range is what scipy's minimum says."""
    from scipy.optimize import least_squares

    points = (25.0 + 0.01 * (OUTWARD[:, 1] > 0))[:, None] * OUTWARD
    best = least_squares(lambda c: np.hypot(*(points - c[:2]).T) - c[2], [0.0, 0.0, 25.0], xtol=1e-15, ftol=1e-15).x
    assert best[1] == pytest.approx(2 * 0.01 / np.pi, rel=1e-2)
    assert circular_deviation([points]) == pytest.approx(np.ptp(np.hypot(*(points - best[:2]).T)), rel=1e-4)


def test_both_directions_stand_on_one_plot():
    """Out by 5 um one way round, in by 3 um the other."""
    ccw = view("a", clockwise=False, radial=lambda t: 5.0 + 0.0 * t)
    cw = view("b", clockwise=True, radial=lambda t: -3.0 + 0.0 * t)
    (figure,) = circles_section([ccw, cw], ()).figures
    names = [each["name"] for each in figure.traces]
    assert {"counter-clockwise, measured", "clockwise, measured", "ring at +5 µm"} <= set(names)
    shifts = dict(zip(names, figure.exaggerate["shifts"], strict=True))
    assert 1e3 * np.hypot(shifts["clockwise, measured"]["x"], shifts["clockwise, measured"]["y"]) == pytest.approx(
        3.0, rel=1e-3
    )
    assert shifts["clockwise, measured"]["x"][0] == pytest.approx(-3e-3, rel=1e-3), "inwards at angle zero"


def test_loads_do_not_share_a_plot():
    ccw = view("a", clockwise=False, radial=np.cos, cutting=True)
    figures = circles_section([ccw, view("b", clockwise=True, radial=np.sin)], ()).figures
    assert {each.title.rsplit(", ", 1)[1] for each in figures} == {"cutting", "in air"}


def test_values_stand_beside_the_plots():
    turn = CircularTurn(run="a", direction="clockwise", G_um=12.34, F_max_um=5.0, F_min_um=-7.0)
    name = "R 25 mm in XY about (0, 0, 0)"
    table = circles_section([], [CircularTest(circle=name, cutting=False, turns=(turn,), G_both_um=None)]).tables[0]
    (row,) = (dict(zip(table.heads, each, strict=True)) for each in table.rows)
    assert [row[head] for head in ("circle", "run", "direction", "load", "G(b) µm")] == [
        name,
        "a",
        "clockwise",
        "in air",
        "–",
    ]
    assert row["G µm"] == (12.34, "12.3") and row["F min µm"][0] == -7.0


def test_few_rows_make_no_polygon():
    """Sixty rows a turn: chords between them would make a round path deviate by 34 um."""
    one = view("a", clockwise=False, radial=lambda t: 4.0 + 0.0 * t, rows=121)
    ((_, turn),) = circles_of([one])
    assert turn.off(one.position + 1e-3 * one.before) == pytest.approx(4.0, abs=1e-6)
    assert turn.radial(one.before) == pytest.approx(4.0, abs=1e-6)


def test_half_a_circle_is_none():
    whole = view("a", clockwise=False, radial=np.cos)
    whole.before[np.sin(ANGLES) > 0.3] = np.nan
    assert circles_of([whole]) == [] and circles_section([whole], ()) is None


def test_a_run_whose_tip_was_not_measured_in_x_y_z_has_no_circle():
    whole = view("a", clockwise=False, radial=np.cos)
    across = ("along the path", "across the path", "normal to both")
    assert circles_of([dataclasses.replace(whole, channels=across)]) == []
