"""Mistakes with a stock, and warnings where it contradicts other keys."""

import numpy as np
import pytest

from camcomp.compensation.program.compensate import compensate
from camcomp.compensation.program.totals import Totals
from camcomp.ground.errors import ConfigError, ProgramError
from camcomp.ground.files import shipped
from camcomp.model.config.load import load_config
from camcomp.model.control import program_of
from camcomp.model.job import Job

BOX = "workpiece: {stock: {type: box, min_mm: [-30, -30, -9], max_mm: [30, 30, 0]}}\n"
TOOL = "tool: {diameter_mm: 10, teeth: 2}\n"
PASS = "G21 G90 G17\nS8000 M3\nG0 X-20 Y0 Z5\nG1 Z-2 F300\nG1 X20\nG0 Z5\n"
AGAIN = "G0 X-20 Y0\nG1 Z-2\nG1 X20\nG0 Z5\n"


@pytest.fixture
def run(tmp_path):
    def done(text, *sections, machine="cartesian", totals=False):
        (tmp_path / "stock.yaml").write_text("".join(sections))
        job = Job(load_config([shipped(f"config/{machine}.yaml"), tmp_path / "stock.yaml"]))
        program = program_of((text + "M30\n").encode(), "p.nc", job.config)
        result = compensate(program, job, method="newton", tolerance_um=1.0, version="1")
        return Totals.of(result, job) if totals else result

    return done


@pytest.mark.parametrize(
    ("rule", "sections"),
    [
        ("CC295", (BOX,)),
        ("CC295", (BOX, "tools: {0: {type: ball}}\n")),
        ("CC296", (BOX.replace("{stock", "{rotation_vector_deg: [10, 0, 0], stock"), TOOL)),
        ("CC297", ("workpiece: {stock: {type: stl, file: nothing.stl}}\n", TOOL)),
        ("CC298", (BOX.replace("[-30, -30, -9], max_mm: [30, 30, 0]", "[50, 50, -9], max_mm: [90, 90, 0]"), TOOL)),
    ],
)
def test_a_stock_that_cannot_be_used_is_refused_at_its_place(run, rule, sections):
    with pytest.raises(ConfigError) as found:
        run(PASS, *sections)
    assert found.value.rule == rule and found.value.at.line > 0


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (None, "No such file"),
        (b"", "no body"),
        (
            bytes(80) + (12).to_bytes(4, "little") + bytes(100),
            r"counts 12 triangles, which are 684 bytes, and the file has 184 \(2 triangles",
        ),
        (
            b"solid x".ljust(80) + (1).to_bytes(4, "little") + bytes(100),
            r"counts 1 triangles, which are 134 bytes, and the file has 184",
        ),
        (b"\0" * 84, "no body"),
        (b"solid part\nendsolid part\n", "no body"),
        (b"solid x\nfacet\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nendloop\nendfacet\n", "1 facets and 2 corners"),
        (
            b"solid x\nfacet\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 1 a 0\nendloop\nendfacet\n",
            "no three numbers",
        ),
    ],
)
def test_what_is_wrong_with_a_file_is_said(run, tmp_path, content, said):
    if content is not None:
        (tmp_path / "block.stl").write_bytes(content)
    with pytest.raises(ConfigError, match=said) as found:
        run(PASS, "workpiece: {stock: {type: stl, file: block.stl}}\n", TOOL)
    assert found.value.rule == "CC297"


@pytest.mark.parametrize(("missing", "said"), [(0, None), (2, "4 edges have a triangle on one side only, as at -30 ")])
def test_a_body_with_a_hole_is_refused(run, tmp_path, missing, said):
    """Material under a hole is undetermined."""
    trimesh = pytest.importorskip("trimesh", reason="it makes the file")
    box = trimesh.creation.box(bounds=[[-30, -30, -9], [30, 30, 0]])
    up = np.argsort(-box.face_normals[:, 2], kind="stable")
    box.update_faces(np.sort(up[missing:]))
    box.export(tmp_path / "block.stl")
    sections = "workpiece: {stock: {type: stl, file: block.stl}}\n", TOOL
    if said is None:
        run(PASS, *sections)
        return
    with pytest.raises(ConfigError, match=said) as found:
        run(PASS, *sections)
    assert found.value.rule == "CC297"


def test_a_stock_that_is_missed_is_told_with_its_place(run):
    with pytest.raises(ConfigError, match="X 50 to 90, Y 50 to 90, Z -9 to 0 mm"):
        run(PASS, BOX.replace("[-30, -30, -9], max_mm: [30, 30, 0]", "[50, 50, -9], max_mm: [90, 90, 0]"), TOOL)


def test_a_rapid_through_material_is_an_error_at_its_line(run):
    with pytest.raises(ProgramError) as found:
        run(PASS + "G0 Z-2\nG0 X20 Y20\n", BOX, TOOL)
    assert found.value.rule == "CC142" and found.value.at.line == 8


def test_a_second_pass_through_a_finished_slot_is_left_as_it_is(run):
    result = run(PASS + AGAIN, BOX, TOOL)
    written = result.written.data.decode().splitlines()
    assert written[-5:-1] == AGAIN.split("\n")[:-1]
    late = result.rows.motion >= 4
    assert not result.rows.force[late].any()
    np.testing.assert_allclose(result.rows.engagement[~late].max(axis=0), [2.0, np.pi], atol=1e-3)


def test_air_is_found_at_the_edge_of_the_stock(run):
    result = run(PASS.replace("X-20", "X-60").replace("X20", "X60"), BOX, TOOL)
    on = result.rows.force.any(axis=1)
    x = result.rows.target[on, 0]
    # the tool's radius is 5 mm; its front has left the stock when its centre does
    assert -35.01 < x.min() < -34.9 and x.max() == pytest.approx(30.0, abs=0.01)


@pytest.mark.parametrize(
    ("key", "good", "bad"),
    [
        ("process: {depth_mm: %s}\n", "2.0", "3.0"),
        ("process: {width_mm: %s}\n", "10.0", "4.0"),
        ("workpiece: {stock_top_mm: %s}\n", "0.0", "1.0"),
        ("tool: {flute_length_mm: %s}\n", "2.5", "1.5"),
    ],
)
def test_what_contradicts_the_stock_is_told_with_its_lines(run, key, good, bad):
    def warned(value):
        line = key % value
        section = line.split(":")[0]
        own = {"workpiece": BOX, "tool": TOOL}.get(section)
        if own is None:
            return run(PASS, BOX, TOOL, line, totals=True).warnings
        merged = own.rstrip().removesuffix("}") + ", " + line.split("{")[1]
        return run(PASS, *(merged if each is own else each for each in (BOX, TOOL)), totals=True).warnings

    assert not [each for each in warned(good) if "source line" in each]
    assert [each for each in warned(bad) if each.endswith("at source line 5")]


def test_a_stock_about_the_program(run):
    result = run(PASS, "workpiece: {stock: {type: program, margin_mm: 3}}\n", TOOL)
    np.testing.assert_allclose(result.rows.engagement.max(axis=0), [2.0, np.pi], atol=1e-3)


def test_tools_by_number_cut_as_wide_as_they_are(run):
    text = PASS.replace("S8000", "T2 M6\nS8000") + AGAIN.replace("X20", "X10").replace(
        "G0 X-20 Y0\n", "T1 M6\nG0 X-20 Y4\n"
    )
    result = run(text, BOX, "tools: {1: {diameter_mm: 4}, 2: {diameter_mm: 10}}\n")
    lines = result.lines
    second = result.rows.engagement[(lines == lines.max() - 1)][:, 1]
    # the narrow tool is 4 mm beside the finished slot of 10 mm: 1 mm of it reaches beyond, on its left
    assert second.max() == pytest.approx(np.arccos(0.5), abs=0.01)


@pytest.mark.parametrize("name", [None, b"block", "Werkst\u00fcck".encode("latin-1"), "\u5de5\u4ef6".encode("gb18030")])
def test_a_mesh_is_cut_as_the_block_that_it_is(run, tmp_path, name):
    trimesh = pytest.importorskip("trimesh", reason="it makes the file")
    block = trimesh.creation.box(bounds=[[-30, -30, -9], [30, 30, 0]])
    data = block.export(file_type="stl" if name is None else "stl_ascii")
    if name is not None:
        data = data.encode("ascii").replace(b"solid ", b"solid " + name, 1)
    (tmp_path / "block.stl").write_bytes(data)
    mesh = run(PASS, "workpiece: {stock: {type: stl, file: block.stl}}\n", TOOL)
    box = run(PASS, BOX, TOOL)
    np.testing.assert_allclose(mesh.rows.engagement, box.rows.engagement, atol=1e-5)
    assert behind_the_stamp(mesh) == behind_the_stamp(box)


def behind_the_stamp(result):
    return result.written.data.split(b"\n", 1)[1]
