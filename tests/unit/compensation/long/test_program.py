"""Long programs: the same result as the exact way, whatever the program is cut into."""

import io
import re

import numpy as np
import pytest

from camcomp.compensation.long import runs
from camcomp.compensation.long.field import Field
from camcomp.compensation.long.program import LongProgram
from camcomp.compensation.long.runs import NotInPieces
from camcomp.compensation.program.compensate import compensate
from camcomp.compensation.program.result import BOUND_UM
from camcomp.compensation.program.totals import Totals
from camcomp.compensation.report import tables
from camcomp.gcode.linear_rows import csv_rows
from camcomp.gcode.stamp import is_stamped
from camcomp.ground.errors import CheckFailed, FileError, PhysicsError, ProgramError
from camcomp.ground.files import shipped
from camcomp.model.config.load import load_config
from camcomp.model.control import program_of, setup_of
from camcomp.model.job import Job
from tests.benchmarks.programs import groove
from tests.unit.compensation.long.test_fast import random_lines

NUMBER = re.compile(r"-?\d+\.?\d*")
LAST_DIGIT = 1.001e-4


@pytest.fixture(autouse=True)
def short_runs(monkeypatch):
    monkeypatch.setattr(runs, "PROBE_MOTIONS", 8)


def job_of(name):
    return Job(load_config([shipped(f"config/{name}.yaml")]))


@pytest.fixture(scope="module")
def orthoglide():
    return job_of("orthoglide-1deg")


@pytest.fixture(scope="module")
def cartesian():
    return job_of("cartesian")


def both(job, text, tolerance=1.0):
    """(bulk output, its totals, its batches), exact result."""
    data = text.encode("latin-1")
    batches, out = [], io.BytesIO()
    totals = LongProgram(
        job=job, name="p.nc", setup=setup_of(job.config), tolerance_um=tolerance, version="1", on_rows=batches.append
    ).run(io.BytesIO(data), out.write)
    exact = compensate(program_of(data, "p.nc", job.config), job, method="newton", tolerance_um=tolerance, version="1")
    return (out.getvalue().decode("latin-1"), totals, batches), exact


def assert_same(job, text, tolerance=1.0, feed=2e-4):
    """The two ways agree: text, rows and figures; feeds by the share `feed`."""
    (ours, totals, batches), exact = both(job, text, tolerance)
    theirs = exact.written.data.decode("latin-1")
    assert NUMBER.sub("#", ours) == NUMBER.sub("#", theirs)
    for a, b in zip(ours.splitlines(), theirs.splitlines(), strict=True):
        if "sha256" in a or a == b:
            assert a == b
            continue
        for (x, u), (y, v) in zip(*(re.findall(r"([A-Z])(-?\d+\.?\d*)", each) for each in (a, b)), strict=True):
            assert x == y and abs(float(u) - float(v)) <= (LAST_DIGIT if x != "F" else feed * float(v)), (a, b)
    everything = {
        "line": exact.lines, "s": exact.s, "t": exact.t, "target": exact.rows.target, "written": exact.written.end,
        "force": job.frame.vectors(exact.rows.force), "nominal": exact.nominal, "joints": exact.state.rho,
    }  # fmt: skip
    for name, values in everything.items():
        mine = np.concatenate([getattr(batch, name) for batch in batches])
        np.testing.assert_allclose(mine, values, rtol=1e-9, atol=2 * LAST_DIGIT, err_msg=name)
    drive = np.concatenate([batch.drive for batch in batches])
    np.testing.assert_allclose(drive, exact.state.drive, atol=2e-3 + 2e-4 * np.abs(exact.state.drive).max())
    mine, other = totals.summary().as_json(), Totals.of(exact, job).summary().as_json()
    assert set(other) <= set(mine)
    for key in ("points", "segments_in", "lines_out", "joining_lines", "method", "warnings"):
        assert mine[key] == other[key], key
    for key in ("before", "after"):
        assert mine[key] == pytest.approx(other[key], rel=2e-3, abs=5e-3), key
    for key in ("cycle_time_s", "under_control"):
        assert mine[key] == pytest.approx(other[key], rel=2e-3, abs=5e-3), key
    assert mine["actuator_change_max_mm"] == pytest.approx(other["actuator_change_max_mm"], abs=2e-4)
    assert mine["actuator_force_max_N"] == pytest.approx(other["actuator_force_max_N"], rel=2e-4)
    assert mine["interpolation"]["worst_um"] <= 0.05
    return totals, batches


def test_a_groove_on_the_imperfect_machine(orthoglide):
    totals, _ = assert_same(orthoglide, "\n".join(groove(300)) + "\n")
    assert totals.summary().interpolation.tiles > 0 and totals.failed_checks(1.0) == []


HEAD = "%\n(two spirals)\nN10 G21 G90 G17 G94\nN20 T1 M6\nN30 S8000 M3\nN40 G0 X20 Y0 Z5\nG1 Z0 F300\n"


def circle(count, radius=20.0, turns=0.2, code="G1 ", z=0.0):
    for k in range(count):
        a = 6.2832 * turns * (k + 1) / count
        yield f"{code}X{radius * np.cos(a):.4f} Y{radius * np.sin(a):.4f} Z{z - 0.001 * k:.4f}"


def mixed(eol="\n"):
    """Everything that stands between plain lines: arcs, comments, modal words, rapids, stops, long lines, corners."""
    lines = [
        *circle(20), "(a comment)", *circle(12, code="", turns=0.3), "M8", "G3 X-20 Y0 I6.1804 J-19.0211 F200", *circle(15, radius=22.0),
        "G1 X40 Y0 F500", "Y30", "X-10 Z1", "G0 Z6", "G0 X22 Y0", "Z0.5", *circle(18, radius=22.0), "F250", "S6000", *circle(11, 24.0),
        "G91 G1 X1 Y1", "X-1", "G90", *circle(14, 21.0), "G4 P0.1", "G1 X21 Y3 ; turn back", *circle(9, 21.0), "x5 y5", "n7 x6 y7",
        "G0 Z9", "M5", "M30", "%",
    ]  # fmt: skip
    return HEAD.replace("\n", eol) + eol.join(lines) + eol


@pytest.mark.parametrize("eol", ["\n", "\r\n", "\r\r\n"])
def test_programs_with_everything_between_plain_lines(cartesian, eol):
    assert_same(cartesian, mixed(eol))


@pytest.mark.parametrize("chunk", [64, 150, 333])
def test_cut_anywhere(cartesian, monkeypatch, chunk):
    monkeypatch.setattr(runs, "CHUNK_BYTES", chunk)
    monkeypatch.setattr(runs, "RUN", 16)
    assert_same(cartesian, mixed())


def test_runs_are_full_wherever_a_chunk_of_the_file_ends(cartesian, monkeypatch):
    monkeypatch.setattr(runs, "CHUNK_BYTES", 333)
    monkeypatch.setattr(runs, "RUN", 50)
    source = io.BytesIO((HEAD + "\n".join(circle(500)) + "\n").encode())
    found = runs.Runs(source=source, name="p.nc", setup=setup_of(cartesian.config), dialect=None)
    motions = [each.motions for each in found if getattr(each, "linear", None) is not None]
    assert motions[-10:-1] == [50] * 9


def test_points_that_were_aimed_at_are_not_looked_up_again(orthoglide, monkeypatch):
    """Also where the trial points inside of a line are no division points, so that there is no point to aim at."""
    asked, look = [], Field.look

    def counted(self, target, force, *, every=True):
        asked.extend([every] * bool(len(target)))
        return look(self, target, force, every=every)

    monkeypatch.setattr(Field, "look", counted)
    lines = "\n".join(f"G1 X{22 + 10 * (k % 2)} Y{0.01 * k:.2f} Z0" for k in range(300))
    both(orthoglide, HEAD + lines + "\n", tolerance=50.0)
    assert asked == [True, False] * 2 + [True] * 3, "trial points and middles of two runs, and three times the proof"


def test_long_lines_are_divided_alike(orthoglide):
    """Where along a line a division point stands hardly matters; how far it is from the line does."""
    lines = [
        f"G1 X{x} Y{y} Z0"
        for x, y in ((25, 5), (10, 12), (12, 25), (11, 24), (5, 5), (6, 5), (5, 6), (8, 8), (9, 9), (12, 9))
    ]
    (_, totals, batches), exact = both(orthoglide, HEAD + "\n".join(lines) + "\nG0 Z5\nM30\n")
    assert totals.points == len(exact.lines) > 20
    written = np.concatenate([batch.written for batch in batches])
    way = np.diff(exact.written.end, axis=0, prepend=exact.written.end[:1])
    way /= np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-9)
    off = written - exact.written.end
    along = np.sum(off * way, axis=1)
    assert np.abs(along).max() <= 1e-2 and np.abs(off - along[:, None] * way).max() <= 2 * LAST_DIGIT
    ends = np.flatnonzero(np.diff(exact.lines, append=0))
    assert np.abs(written - exact.written.end)[ends].max() <= LAST_DIGIT
    mine, other = (each.after.rms_um for each in (totals.summary(), Totals.of(exact, orthoglide).summary()))
    assert totals.after.most_um <= 1.0 and mine == pytest.approx(other, rel=0.02)


@pytest.mark.parametrize("model", ["mechanistic", "none"])
def test_other_force_models(tmp_path, model):
    more = tmp_path / "force.yaml"
    text = {
        "mechanistic": "{model: mechanistic, Ktc_N_per_mm2: 600, Krc_N_per_mm2: 200, Kac_N_per_mm2: 50, Kte_N_per_mm: 10, "
        "Kre_N_per_mm: 8, Kae_N_per_mm: 0}",
        "none": "{model: none}",
    }[model]
    more.write_text(f"process:\n  depth_mm: 2\n  force: {text}\ntool: {{teeth: 2, diameter_mm: 10}}\n")
    job = Job(load_config([shipped("config/cartesian.yaml"), more]))
    (ours, totals, _), exact = both(job, mixed())
    assert NUMBER.sub("#", ours) == NUMBER.sub("#", exact.written.data.decode())
    mine, other = (dict(each.before) for each in (totals.summary(), Totals.of(exact, job).summary()))
    assert mine == pytest.approx(other, rel=1e-3, abs=1e-3)
    assert totals.after.most_um <= 1.0


def stock(tmp_path, top):
    more = tmp_path / "stock.yaml"
    more.write_text(f"workpiece: {{origin_mm: [0, 0, 0], stock_top_mm: {top}}}\n")
    return Job(load_config([shipped("config/cartesian.yaml"), more]))


def test_work_above_and_below_the_stock_top(tmp_path):
    lines = [
        *circle(20),
        "G1 Z1.5 F300",
        *circle(12, 22.0, z=1.0),
        "Z-1",
        *circle(10, 21.0, z=-1.0),
        *circle(10, 21.0, z=1.0),
    ]
    assert_same(stock(tmp_path, 0.5), HEAD + "\n".join(lines) + "\nG0 Z5\nM30\n")


@pytest.mark.parametrize(
    "lines",
    [
        ["F200", "M8", "G3 I-5 J0", "G1"],  # the feed of a line without motion is in force behind it
        ["M8", "G2 I-1 J0", "G1 F900", "X17.5"],
        ["G53 G0 Z20", "G1 X10 Y5 Z0"],  # from an uncorrected place back onto the path
        ["G0 X30", "G28 Z0", "G0 X20 Y0", "G1 Z0"],
        ["X20 Y0 Z-0.5", "X20 Y0 Z-0.5", "M8", "X20 Y0 Z-0.5", "X20 Y0"],  # moves without length
        ["X20 Y0 Z5", "X20.003 Y0.002 Z0", "X20.03 Y0 Z-1", "X20 Y0.1 Z0"],  # plunges that slant, and ramps
        ["G55", "G1 X1 Y1", "G54 X2", "G20", "X0.5 Y0.5 F20", "G21", "F300"],
        ["G91", "X1", "X1 Y1", "G90", "G93", "X5 F30", "X6 F31", "G94 F300"],
        ["X30 Y0", "M8", "X30 Y9", "S900", "X20 Y9", "Y0"],  # where the control waits it rounds no corner
        ["G1 X15 Y0 F300.2", "M8", "X14 F300.4", "M9", "X13 F300.3"],  # feeds that differ by less than is written
    ],
)
def test_the_control_is_followed_from_piece_to_piece(cartesian, lines):
    assert_same(
        cartesian, HEAD + "\n".join([*circle(20), *lines, *circle(20, 21.0, code=""), *lines, *circle(9)]) + "\nM30\n"
    )


def random_program(seed):
    """Plain lines in many spellings with odd ones between them."""
    rng = np.random.default_rng(seed)
    odd = [
        "M8",
        "(note)",
        "G4 P0.2",
        "S4000",
        "",
        "G91\nG1 X0.5 Y-0.25\nG90",
        "N7",
        "G17",
        "G2 I5 J0\nG1",
        "F400",
        "G20\nG21",
        "G53 G0 Z12",
    ]
    lines = ["G0 X0 Y0 Z2", "G1 F500"]
    for text in random_lines(rng, 150):
        lines.append(text)
        if rng.random() < 0.06:
            lines.append(str(rng.choice(odd)))
    return HEAD + "\n".join(lines) + "\nM30\n"


@pytest.mark.parametrize("seed", range(6))
def test_random_programs(cartesian, seed):
    assert_same(cartesian, random_program(seed))


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("eol", ["\n", "\r\n", "\r\r\n"])
def test_zero_correction_keeps_every_byte(seed, eol):
    job = Job(load_config([shipped("config/orthoglide.yaml"), shipped("config/no-force.yaml")]))
    text = random_program(seed).replace("\n", eol) if seed else mixed(eol)
    out, _ = run(job, text)
    lines = out.decode("latin-1").split(eol)
    assert "camcomp" in lines[1] and eol.join(lines[:1] + lines[2:]) == text


# --- what a user sees -------------------------------------------------------------------------------------------------


def run(job, text, **more):
    out = io.BytesIO()
    totals = LongProgram(job=job, name="p.nc", setup=setup_of(job.config), tolerance_um=1.0, version="1", **more).run(
        io.BytesIO(text.encode("latin-1")), out.write
    )
    return out.getvalue(), totals


def test_the_output_is_stamped_and_refused_a_second_time(cartesian):
    once, _ = run(cartesian, mixed())
    assert is_stamped(once)
    with pytest.raises(CheckFailed) as error:
        run(cartesian, once.decode())
    assert error.value.rule == "CC603"


def test_a_program_that_changes_while_it_is_read_is_refused(cartesian):
    class Edited(io.BytesIO):
        def seek(self, *place):
            at = super().seek(*place)
            self.getbuffer()[-5:-4] = b" "  # between two readings
            return at

    text = HEAD + "\n".join(circle(30)) + "\nM30\n"
    program = LongProgram(job=cartesian, name="p.nc", setup=setup_of(cartesian.config), tolerance_um=1.0, version="1")
    with pytest.raises(FileError) as error:
        program.run(Edited(text.encode()), io.BytesIO().write)
    assert error.value.rule == "CC500" and "p.nc" in error.value.message


def test_errors_name_the_line_of_the_whole_program(cartesian, orthoglide):
    text = HEAD + "\n".join(circle(30)) + "\nX1,5\n"
    with pytest.raises(ProgramError) as error:
        run(cartesian, text)
    assert (error.value.at.line, error.value.at.source) == (38, "X1,5")
    text = HEAD + "\n".join(["G1 X20.1"] * 9 + ["  G1 X900 Y0"] + ["G1 X20"] * 9) + "\n"
    with pytest.raises(PhysicsError) as error:
        run(orthoglide, text)
    assert (error.value.rule, error.value.at.line, error.value.at.column) == ("CC302", 17, 6)
    assert error.value.at.source == "  G1 X900 Y0"


def test_warnings_name_the_line_of_the_whole_program(cartesian):
    _, totals = run(cartesian, HEAD + "\n".join(circle(30)) + "\nM199\n" + "\n".join(circle(30)) + "\nM30\n")
    assert any(each.startswith("p.nc:38: M199") for each in totals.warnings)


@pytest.mark.parametrize("line", ["#1=5", "G92 X0", "G81 X1 Y1 Z-1 R1 F100"])
def test_programs_that_cannot_be_cut_are_recognised(cartesian, line):
    with pytest.raises(NotInPieces):
        run(cartesian, HEAD + "\n".join(circle(30)) + f"\n{line}\n" + "\n".join(circle(30)) + "\nM30\n")


def test_limits_are_told_with_their_lines(tmp_path):
    narrow = tmp_path / "narrow.yaml"
    narrow.write_text(shipped("config/cartesian.yaml").read_text().replace("[-10000, 10000]", "[-15, 15]", 1))
    _, totals = run(Job(load_config([narrow])), HEAD + "\n".join(circle(30)) + "\n")
    (rule, text), = totals.failed_checks(1.0)  # fmt: skip
    assert rule == "CC602" and "actuator x" in text and "source lines 6, 7, 8" in text


def test_a_field_that_lies_is_caught(cartesian, monkeypatch):
    truth = Field.packed

    def wrong(self):
        packed = list(truth(self))
        packed[4] = packed[4] * 1.01  # the coefficients
        return tuple(packed)

    monkeypatch.setattr(Field, "packed", wrong)
    _, totals = run(cartesian, HEAD + "\n".join(circle(30)) + "\n")
    assert [rule for rule, _ in totals.failed_checks(1.0)] == ["CC607"]
    assert totals.summary().interpolation.worst_um > BOUND_UM


# --- tables -----------------------------------------------------------------------------------------------------------


def test_compiled_csv_is_that_of_python():
    rng = np.random.default_rng(5)
    values = rng.normal(0, 100, (200, 4)) * [1, 1e-7, 1e3, 1]
    values[3, 2], values[4, 0], values[5, 1] = np.nan, -0.0, -4e-7
    values[6, 2], values[7, 0] = -8_999_999_999.5, 8_999_999_999.25  # the largest have 19 digits
    line = rng.integers(1, 10**6, 200)
    text = csv_rows(line, values, np.array([6, 6, 9, 6])).decode()
    for i, row in enumerate(text.splitlines()):
        cells = [f"{v:.{d}f}" if np.isfinite(v) else "" for v, d in zip(values[i], (6, 6, 9, 6), strict=True)]
        cells = [c[1:] if c.startswith("-") and float(c) == 0.0 else c for c in cells]
        assert row.split(",")[0] == str(line[i])
        for ours, theirs in zip(row.split(",")[1:], cells, strict=True):
            assert ours == theirs or abs(float(ours) - float(theirs)) <= 1.01e-6


def test_tables_are_the_same_in_stretches_of_any_length(monkeypatch):
    line, values, files = np.arange(1, 24), np.random.default_rng(6).normal(0, 100, (23, 2)), []
    for rows in (tables.AT_ONCE, 7, 23):
        monkeypatch.setattr(tables, "AT_ONCE", rows)
        files.append(io.BytesIO())
        tables.CsvFile(files[-1], ["line", "x_mm", "a_rad"]).rows(line, values)
    assert len({each.getvalue() for each in files}) == 1 and files[0].getvalue().count(b"\n") == 24


def test_a_control_with_four_decimals_of_an_inch(orthoglide):
    lines = "".join(f"X{0.02 * k:.4f} Y{0.1 + 0.01 * (k % 7):.4f} F{10 + k % 3}.\n" for k in range(60))
    text = f"%\nO0001 (TEST)\nG20 G90 G17\nM3 S2000\nG0 X0. Y0. Z1.\nG1 Z0. F10.\n{lines}G0 Z1.\nM30\n%\n"
    (ours, _, _), _ = both(orthoglide, text, 8.0)
    assert_same(orthoglide, text, 8.0)
    assert re.search(r"X\d\.\d{4} ", ours) and not re.search(r"[XYZ]-?\d*\.\d{5}", ours)
    assert not re.search(r"F\d+(?![.\d])", ours)


EFFECTS = """
effects:
  - {effect: joint_offset, target: x, offset_mm: 0.02}
  - {effect: thermal_growth, target: y, growth_mm_per_K: 0.004, warm_up_s: 60}
"""


def test_effects_that_depend_on_time_go_on_from_piece_to_piece(tmp_path, monkeypatch):
    (tmp_path / "effects.yaml").write_text(EFFECTS)
    job = Job(load_config([shipped("config/orthoglide-1deg.yaml"), tmp_path / "effects.yaml"]))
    text = "\n".join(groove(900)).encode()
    monkeypatch.setattr(runs, "RUN", 300)
    written = []
    pieces = LongProgram(job=job, name="p.nc", setup=setup_of(job.config), tolerance_um=1.0, version="1")
    figures = pieces.run(io.BytesIO(text), written.append).summary()
    whole = compensate(program_of(text, "p.nc", job.config), job, method="newton", tolerance_um=1.0, version="1")
    words = re.compile(rb"[XYZ](-?\d+\.\d+)")
    mine, theirs = (np.array(words.findall(each), float) for each in (b"".join(written), whole.written.data))
    assert len(mine) == len(theirs) and np.abs(mine - theirs).max() < 1.5e-4, "the last of four decimals"
    assert sum("warming up" in each for each in figures.warnings) == 1
