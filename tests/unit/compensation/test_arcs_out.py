"""Arcs through points, and programs whose arcs come out as arcs."""

import numpy as np
import pytest

from camcomp.compensation.program import division
from camcomp.compensation.program.compensate import compensate
from camcomp.compensation.program.division import Nodes, divide
from camcomp.compensation.program.verify import verify
from camcomp.gcode.interpret import read_program
from camcomp.ground import path_geometry
from camcomp.ground.datatypes import ARC, Curves
from camcomp.ground.files import shipped
from camcomp.model.config.load import load_config
from camcomp.model.job import Job
from tests.fewest import groove

AXES = np.array([[0.0, 0, 1], [0, 1, 0], [1, 0, 0]])


def on_circle(axis, angle, radius=3.0, centre=(1.0, 2.0, 4.0), climb=0.0):
    """Points at angles (k,) of a circle or helix about an axis (3,)."""
    u = np.roll(axis, 1)
    v = np.cross(axis, u)
    angle = np.asarray(angle, float)[:, None]
    return np.asarray(centre) + radius * (np.cos(angle) * u + np.sin(angle) * v) + climb * angle * axis


@pytest.mark.parametrize("axis", AXES)
@pytest.mark.parametrize("turn", [0.1, 2.0, -0.1, -2.0, -5.0])
def test_an_arc_is_found_from_three_of_its_points(axis, turn):
    at = 0.7 + turn * np.linspace(0.0, 1.0, 9)
    points = on_circle(axis, at, climb=0.2)
    three, axes = points[[0, 4, 8], None], axis[None]
    centre, wrong = division.through(*three, axes, np.array([turn]), 1e-4)
    assert not wrong.any() and np.isfinite(centre).all()
    angle = division.sweeps(three[0], three[2], centre, axes, np.array([turn]))
    assert angle[0] == pytest.approx(turn, abs=1e-12)
    assert centre[0] - points[0] == pytest.approx(np.array([1.0, 2, 4]) + 0.14 * axis - points[0], abs=1e-12)
    arc = Curves(kind=np.array([ARC]), start=three[0], end=three[2], centre=centre, axis=axes, angle=angle)
    again = path_geometry.points(arc, np.zeros(9, np.int64), np.linspace(0, 1, 9))
    np.testing.assert_allclose(again, points, atol=1e-12)
    assert path_geometry.lengths(arc)[0] == pytest.approx(np.hypot(3.0 * turn, 0.2 * turn))
    assert division.through(*three, axes, np.array([-turn]), 1e-4)[1].all()  # the middle lies on the other way round


def test_what_hardly_bends_is_a_line():
    z = np.array([[0.0, 0, 1]])
    start, end = np.zeros((1, 3)), np.array([[10.0, 0, 1]])
    flat, wrong = division.through(start, np.array([[5.0, 1e-5, 0.5]]), end, z, np.array([-1.0]), 2e-4)
    assert np.isnan(flat).all() and not wrong.any()


def test_a_floor_of_the_bend_divides_what_does_not_bend():
    trial = Nodes(np.zeros(9, np.int64), np.linspace(0, 1, 9), np.array([0, 9]))
    nodes, shift = divide(trial, np.zeros((9, 3)), np.array([1e-3]), np.array([3.0 * np.sqrt(16e-3)]))
    assert len(nodes.w) - 1 == 4 and not shift.any()
    assert (np.diff(nodes.w) < 0.4).all()


def corrected(text, config="config/cartesian.yaml", **options):
    settings = load_config((str(shipped(config)),))
    program = read_program(text.encode(), name="in.nc", **options)
    job = Job(settings)
    result = compensate(program, job, method="newton", tolerance_um=1.0, version="0", arcs=True)
    after = read_program(result.written.data, name="out.nc", **options)
    return result, program, after, job


def check(text, config="config/cartesian.yaml", **options):
    """Compensated with arcs, the program keeps the tolerance by its text alone; moves by lines and by arcs."""
    result, program, after, job = corrected(text, config, **options)
    assert 1e3 * np.linalg.norm(result.after, axis=1).max() <= 1.0
    assert 1e3 * verify(after, program, job).residual.max() <= 1.0
    straight = compensate(program, job, method="newton", tolerance_um=1.0, version="0", arcs=False)
    assert not (straight.rows.kind == ARC).any()
    return straight, result, after


HEAD = "G21 G90 G17 G94\nG0 X10 Y0 Z0\n"
ARCS = {
    "circle": "G3 X10 Y0 I-10 J0 F600\n",
    "clockwise": "G2 X0 Y-10 I-10 F600\n",
    "helix": "G3 X10 Y0 Z-4 I-10 J0 P3 F600\n",
    "radius": "G3 X0 Y10 R10 F600\nX10 Y0 R-10\n",
    "inch": "G20 G3 X0 Y0.3 R0.4 F20\n",
    "relative": "G91 G3 X-10 Y10 I-10 F600\nX-10 Y-10 J-10\n",
    "centre": "G90.1 G3 X0 Y10 I0 J0 F600\n",
    "inverse time": "G93 G3 X-10 Y0 I-10 F20\n",
    "pocket": "G1 X8 F600\nG2 X10 Y2 I2\nG1 Y5\nG3 X8 Y7 I-2\nG1 X4\nG3 X4 Y7 I-4\n",
}


@pytest.mark.parametrize("name", ARCS)
def test_arcs_come_out_as_fewer_arcs_within_the_tolerance(name):
    straight, result, after = check(HEAD + ARCS[name] + "M2\n")
    bent = result.rows.bent
    assert bent.any() and len(result.rows.w) <= 0.5 * len(straight.rows.w)
    assert len(result.written.data) < len(straight.written.data)
    # What the text says is what was put through the model.
    kind = after.path.kind == ARC
    assert kind.sum() == bent.sum()
    flat = 1.0 - after.path.axis[kind]
    assert np.abs((after.path.centre[kind] - result.written.centre[bent]) * flat).max() < 1e-7
    assert np.abs(after.path.end[kind] - result.written.end[bent]).max() < 1e-7


@pytest.mark.parametrize("plane", ["G18", "G19"])
def test_arcs_in_other_planes(plane):
    # a quarter that does not pass the vertical, where the direction across the feed turns over
    words = "X17 Z-2.9289 R10" if plane == "G18" else "Y7 Z-2.9289 R10"
    straight, _, after = check(f"{HEAD}{plane} G3 {words} F600\nM2\n")
    assert 0 < (after.path.kind == ARC).sum() < 0.5 * len(straight.rows.w)


@pytest.mark.parametrize(
    ("dialect", "words"), [("fanuc", "G3 X0 Y10 R10"), ("grbl", "G3 X0 Y10 I-10 J0"), ("sinumerik", "G3 X0 Y10 CR=10")]
)
def test_every_dialect_gets_its_arcs(dialect, words):
    head = HEAD.replace("G21", "G71") if dialect == "sinumerik" else HEAD
    straight, _, after = check(f"{head}{words} F600\nG1 X20\nM30\n", dialect=dialect)
    assert 0 < (after.path.kind == ARC).sum() < 0.5 * len(straight.rows.w)


@pytest.mark.parametrize("radius", [0.0002, 0.0004, 0.001, 0.003, 0.01, 0.03])
@pytest.mark.parametrize("turn", [0.01, 0.5, 3.0, 6.0, 6.28])
def test_tiny_arcs_never_become_circles(radius, turn):
    end = radius * (np.array([np.cos(turn), np.sin(turn)]) - [1, 0])
    text = f"{HEAD}G3 X{10 + end[0]:.5f} Y{end[1]:.5f} I{-radius:.5f} J0 F100\nG1 X20\nM2\n"
    program = read_program(text.encode(), name="in.nc")
    _, _, after, _ = corrected(text)
    meant = np.abs(program.path.angle[program.path.kind == ARC]).sum() * radius
    made = after.path.kind == ARC
    reach = np.linalg.norm((after.path.start - after.path.centre)[made], axis=1)
    assert (reach * np.abs(after.path.angle[made])).sum() <= 1.3 * meant + 0.1  # 0.1: the force turns with the feed
    assert (np.abs(after.path.angle[made]) < 3.2).all()


def test_the_tip_keeps_its_speed_on_arcs():
    _, _, after = check(HEAD + "G3 X-10 Y0 I-10 F600\nM2\n", "config/orthoglide-1deg.yaml")
    kind = after.path.kind == ARC
    minutes = (path_geometry.lengths(after.path)[kind] / after.path.feed[kind]).sum()
    assert minutes == pytest.approx(np.pi * 10 / 600, rel=2e-3)
    assert len(set(after.path.feed[kind])) > 1


@pytest.mark.parametrize(("name", "most"), [(50, 0.15), (2, 1.0)])
def test_the_sample_grooves_as_arcs(name, most):
    lines, _, _ = groove(name)
    bent, _, _ = groove(name, arcs=True)
    assert bent <= most * lines


def test_the_machine_file_asks_for_arcs():
    settings = load_config((str(shipped("config/cartesian.yaml")),))
    program = read_program((HEAD + ARCS["circle"] + "M2\n").encode(), name="in.nc")
    assert (
        compensate(program, Job(settings), method="newton", tolerance_um=1.0, version="0").rows.kind == ARC
    ).sum() == 0
    on = settings.model_copy(update={"compensation": settings.compensation.model_copy(update={"arcs": True})})
    assert (compensate(program, Job(on), method="newton", tolerance_um=1.0, version="0").rows.kind == ARC).any()


@pytest.mark.parametrize("config", ["config/cartesian.yaml", "config/orthoglide-1deg.yaml"])
@pytest.mark.parametrize(
    "words", ["G18 G3 X10 Z0 I-10 K0", "G18 G2 X-10 Z0 R10", "G19 G3 Y0 Z0 J-6 K8", "G19 G2 Y-20 Z0 R-10.5"], ids=str
)
def test_where_an_upright_arc_passes_the_vertical_it_is_led_from_one_force_to_the_other(words, config):
    straight, _, _ = check(f"{HEAD}{words} F600\nG1 X12\nM2\n", config)
    assert 1e3 * np.linalg.norm(straight.after, axis=1).max() <= 1.0
    inside = straight.rows.joining & (straight.rows.motion == 1)
    assert inside.any()
    program = straight.program
    after = read_program(straight.written.data, name="out.nc")
    assert 1e3 * verify(after, program, Job(load_config((str(shipped(config)),)))).residual.max() <= 1.0
