"""What programs can say reaches the stock: cycles, inches, arcs in other planes, subprograms; batches and streams beside it."""

import numpy as np
import pytest

from camcomp.api.batch import compensate_many
from camcomp.compensation.program.compensate import compensate
from camcomp.compensation.set_points.stream import Stream
from camcomp.ground import path_geometry
from camcomp.ground.files import shipped
from camcomp.model.config.load import load_config
from camcomp.model.control import program_of
from camcomp.model.job import Job

DEGREES, MICROMETRES = np.radians(0.5), 5e-3
MACHINE = shipped("config/cartesian.yaml")
STOCK = """
workpiece: {stock: {type: box, min_mm: [-30, -30, -12], max_mm: [30, 30, 0]}}
tool: {diameter_mm: 10, teeth: 2}
tools: {1: {diameter_mm: 6, type: drill}, 2: {diameter_mm: 10, teeth: 2}}
"""
HEAD = "G21 G90 G17 G94\nS8000 M3\n"


@pytest.fixture
def job(tmp_path):
    (tmp_path / "stock.yaml").write_text(STOCK)
    return Job(load_config([MACHINE, tmp_path / "stock.yaml"]))


def followed(job, text, **more):
    program = program_of((text + "M30\n").encode(), "p.nc", job.config)
    return program.path, job.engaged(program), compensate(program, job, method="newton", tolerance_um=1.0, version="1")


def of_lines(path, engaged, *lines):
    """Depth and sum of arcs at all places of motions of some source lines."""
    rows = np.isin(path.line[engaged.motion], lines)
    return engaged.depth[rows], engaged.turn[rows]


@pytest.mark.parametrize("cycle", ["G81", "G82 P0.1", "G83 Q1.5", "G73 Q1.5", "G85"])
def test_a_hole_of_a_cycle_is_missing_where_a_slot_crosses_it_and_is_drilled_without_force(job, cycle):
    """The front of a tool of radius 5 is a hole's diameter of 6 less where it stands over the middle of the hole."""
    drill = f"T1 M6\nG0 X0 Y0 Z5\nG98 {cycle} X0 Y0 Z-9 R1 F200\nX20\nG80\n"
    text = HEAD + drill + "T2 M6\nG0 X-40 Y0\nG0 Z-2\nG1 X40 F600\nG0 Z5\n"
    path, engaged, result = followed(job, text)
    slot = int(np.flatnonzero(path.line == 11)[0])
    assert of_lines(path, engaged, 5, 6)[1].sum() == 0.0
    assert not result.rows.force[np.isin(result.lines, (5, 6))].any()
    for hole in (0.0, 20.0):
        _, turn = engaged.sizes(np.array([slot]), np.array([(hole - 5.0 + 40.0) / 80.0]), np.array([False]))
        assert turn[0] == pytest.approx(np.pi - 4.0 * np.arcsin(0.3), abs=DEGREES)
    depth, _ = of_lines(path, engaged, 11)
    assert depth.max() == pytest.approx(2.0, abs=MICROMETRES)


def test_a_cycle_that_goes_on_in_layers_comes_back_into_its_own_hole(job):
    """G83 retracts and returns at rapid; a second hole next to it overlaps the first."""
    path, engaged, _ = followed(job, HEAD + "T1 M6\nG0 X0 Y0 Z5\nG83 X0 Y0 Z-9 R1 Q1 F200\nX2\nX0\nG80\n")
    assert not engaged.turn.any() and len(path) > 30


def test_inches_are_cut_as_millimetres(job):
    metric = HEAD + "G0 X-38.1 Y2.54 Z5.08\nG1 Z-2.54 F254\nG1 X0 F508\nG2 X0 Y12.7 I0 J5.08\nG1 X-38.1\nG0 Z5.08\n"
    inch = "G20 G90 G17 G94\nS8000 M3\nG0 X-1.5 Y.1 Z.2\nG1 Z-.1 F10\nG1 X0 F20\nG2 X0 Y.5 I0 J.2\nG1 X-1.5\nG0 Z.2\n"
    (one, first, a), (two, second, b) = followed(job, metric), followed(job, inch)
    np.testing.assert_allclose(one.end, two.end, atol=1e-9)
    assert first.depth.max() == pytest.approx(2.54, abs=MICROMETRES)
    np.testing.assert_allclose(second.depth, first.depth, atol=1e-9)
    np.testing.assert_allclose(second.turn, first.turn, atol=1e-9)
    np.testing.assert_allclose(b.rows.force, a.rows.force, atol=1e-6)


@pytest.mark.parametrize(("plane", "axis", "along"), [("G18", "X", 0), ("G19", "Y", 1)])
@pytest.mark.parametrize("sense", [1, -1])
def test_an_arc_that_dives_and_climbs_cuts_as_deep_as_it_is(job, plane, axis, along, sense):
    """Through the top of the block, down to -3 mm and out again; a slot all the way, and air before and behind."""
    code = {("G18", 1): "G2", ("G18", -1): "G3", ("G19", 1): "G3", ("G19", -1): "G2"}[plane, sense]
    text = (
        HEAD
        + f"G0 X0 Y0 Z5\nG0 {axis}{-16 * sense} Z5\nG1 Z2 F300\n{plane} {code} {axis}{16 * sense} Z2 R28.1 F500\nG0 Z9\n"
    )
    path, engaged, result = followed(job, text)
    arc = int(np.flatnonzero(path.line == 6)[0])
    u = np.linspace(0.02, 0.98, 97)
    tip = path_geometry.points(path, np.full(len(u), arc), u)
    assert tip[:, 2].min() == pytest.approx(-3.0, abs=0.1) and np.ptp(tip[:, along]) > 30.0
    depth, turn = engaged.sizes(np.full(len(u), arc), u, np.zeros(len(u), bool))
    np.testing.assert_allclose(depth, np.maximum(-tip[:, 2], 0.0), atol=MICROMETRES)
    cuts = tip[:, 2] < -0.01
    np.testing.assert_allclose(turn[cuts], np.pi, atol=DEGREES)
    own = result.lines == 6
    air = result.rows.target[:, 2] > 0.01
    assert (
        not result.rows.force[own & air].any()
        and result.rows.force[own & (result.rows.target[:, 2] < -0.1)].any(axis=1).all()
    )


def test_repeats_and_subprograms_meet_what_they_have_left(job):
    """Three layers of 1 mm by a repeat, there and back; then the whole of it once more by a subprogram."""
    body = "G0 X-20 Y0 Z0.5\nG1 Z0 F200\no101 repeat [3]\nG91 G1 Z-1 F200\nG90 G1 X20 F600\nG1 X-20\no101 endrepeat\nG0 Z5\n"
    text = "o100 sub\n" + body + "o100 endsub\n" + HEAD + "o100 call\no100 call\n"
    path, engaged, result = followed(job, text)
    there = np.flatnonzero(path.line == 6)
    assert len(there) == 6
    for k, motion in enumerate(there):
        depth, _ = engaged.sizes(np.array([motion]), np.array([0.5]), np.array([False]))
        assert depth[0] == pytest.approx(1.0 if k < 3 else 0.0, abs=MICROMETRES)
    back = np.flatnonzero(path.line == 7)
    assert not engaged.turn[np.isin(engaged.motion, back)].any()
    late = result.rows.motion >= there[3] - 2
    assert late.any() and not result.rows.force[late].any() and result.rows.force[~late].any()


def test_a_batch_follows_the_stock_of_every_program_from_the_beginning(tmp_path):
    """Two equal programs: both cut; a memory that went on from one to the other would leave the second one as it is."""
    text = HEAD + "G0 X-40 Y0 Z5\nG0 Z-2\nG1 X40 F600\nG1 X-40\nG0 Z5\nM30\n"
    (tmp_path / "stock.yaml").write_text(STOCK)
    for name in ("a.nc", "b.nc"):
        (tmp_path / name).write_text(text)
    configs = [str(MACHINE), str(tmp_path / "stock.yaml")]
    done = compensate_many([str(tmp_path / "*.nc")], configs, str(tmp_path / "out"), jobs=1)
    assert done["counts"]["done"] == 2
    job = Job(load_config(configs))
    wanted = followed(job, text.removesuffix("M30\n"))[2].written.data
    a, b = ((tmp_path / "out" / name).read_bytes() for name in ("a.nc", "b.nc"))
    assert a == b and wanted.splitlines()[2:] == a.splitlines()[2:]
    assert b"\nG1 X-40\n" in a  # the way back meets nothing


def test_a_stream_gets_its_forces_from_outside_stock_or_not(job):
    plain = Job(load_config([MACHINE]))
    for tip, force in (((1.0, 2.0, -3.0), (30.0, -5.0, 10.0)), ((50.0, 0.0, 5.0), (0.0, 0.0, 0.0))):
        one, two = (Stream(each).correct(tip, force) for each in (plain, job))
        np.testing.assert_array_equal(one.commanded, two.commanded)
        np.testing.assert_array_equal(one.actuators, two.actuators)
