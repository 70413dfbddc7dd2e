"""Path modes as programs and machine files state them, and their effect on a compensation."""

import io
import json

import numpy as np
import pytest

from camcomp.compensation.long.program import LongProgram
from camcomp.compensation.program import under_control
from camcomp.compensation.program.compensate import compensate
from camcomp.compensation.program.totals import Totals
from camcomp.compensation.program.verify import verify
from camcomp.gcode.interpret import read_program
from camcomp.ground.datatypes import ARC
from camcomp.ground.files import shipped
from camcomp.ground.vectors import sizes
from camcomp.model.config.load import load_config
from camcomp.model.control import program_of, setup_of, waiting_s
from camcomp.model.job import Job
from tests import schemas
from tests.commandline import camcomp
from tests.control.programs import circle, raster, rectangle

HEAD = "G21 G90 G17 G94\n"


def job_of(name="orthoglide-1deg", **control):
    config = load_config([shipped(f"config/{name}.yaml")])
    return Job(config.model_copy(update={"control": config.control.model_copy(update=control)}))


@pytest.fixture(scope="module")
def orthoglide():
    return job_of()


def compensated(job, lines, mode="", **options):
    text = "\n".join([HEAD + mode, "S8000 M3", *lines, "M2", ""])
    program = program_of(text.encode(), "p.nc", job.config)
    return compensate(program, job, method="newton", tolerance_um=1.0, version="1", **options)


@pytest.mark.parametrize(
    ("text", "names"),
    [
        ("G1 X1 F100\n", ["G64"]),
        ("G61\nG1 X1 F100\nG64 P0.02\nX2\nX3\n", ["G61", "G64 P0.02", "G64 P0.02"]),
        ("G61.1 G1 X1 F100\n", ["G61.1"]),
        ("G64 P0.02 Q0.005 G1 X1 F100\n", ["G64 P0.02 Q0.005"]),
        ("G64 P0.02 Q0 G1 X1 F100\n", ["G64 P0.02 Q0"]),
        ("G64 P0.02\nG64\nG1 X1 F100\n", ["G64"]),
        ("G20 G64 P0.001\nG1 X1 F10\n", ["G64 P0.0254"]),
    ],
)
def test_modes_are_read_with_their_lengths_in_mm(text, names):
    program = read_program((text + "M2\n").encode(), name="p.nc")
    assert [each.name for each in program.modes] == names


def test_a_mode_of_the_machine_file_is_in_force_until_the_program_says_another(tmp_path):
    (tmp_path / "mode.yaml").write_text("control: {path_mode: G64 P0.05 Q0}\n")
    (tmp_path / "p.nc").write_text(HEAD + "G0 X0 Y0 Z0\nG1 X9 F100\nG61\nG1 X0\nM2\n")
    config = ("--config", shipped("config/cartesian.yaml"), "--config", tmp_path / "mode.yaml")
    done = camcomp("compensate", tmp_path / "p.nc", *config, "--summary", tmp_path / "s.json")
    figures = json.loads((tmp_path / "s.json").read_text())
    assert figures["control_mode"] == "G64 P0.05 Q0, G61" and figures["control_mode_stated"]
    assert (
        set(figures["cycle_time_s"]) == {"before", "after"}
        and b"controller drives in G64 P0.05 Q0, G61: " in done.stderr
    )


def test_what_is_no_mode_is_refused_with_its_place(tmp_path):
    (tmp_path / "mode.yaml").write_text("control:\n  path_mode: G62\n")
    done = camcomp("config", "show", "--config", shipped("config/cartesian.yaml"), "--config", tmp_path / "mode.yaml")
    assert done.returncode == 2 and b"mode.yaml:2:14" in done.stderr


@pytest.mark.parametrize("mode", ["G61", "G64 P0.01"])
def test_arcs_come_out_as_arcs_where_the_control_is_better_off(orthoglide, mode):
    free = compensated(orthoglide, circle(25.0, 3000), mode)
    lines = compensated(orthoglide, circle(25.0, 3000), mode, arcs=False)
    assert (free.rows.kind == ARC).any() and not (lines.rows.kind == ARC).any()
    assert free.control.after_s < 1.02 * lines.control.after_s
    assert free.control.off_joins <= 1.05 * max(lines.control.off_joins, 1e-3)
    assert free.control.after_s < 0.5 * lines.control.after_s or free.control.off_joins < 0.9 * lines.control.off_joins


def test_lines_stay_where_the_mode_is_only_assumed(orthoglide):
    assumed = compensated(orthoglide, circle(25.0, 3000))
    assert not assumed.control.stated and not (assumed.rows.kind == ARC).any()
    assert not any("the controller drives" in each for each in Totals.of(assumed, orthoglide).warnings)


def test_lines_stay_where_the_control_leaves_them_within_the_tolerance(orthoglide):
    free = compensated(orthoglide, circle(25.0, 3000), "G64")
    assert free.control.stated and not (free.rows.kind == ARC).any()
    assert free.control.off_joins <= 1e-3 and free.control.after_s < 1.03 * free.control.original.seconds


def test_the_stops_of_g61_cost_what_the_lines_cost(orthoglide):
    lines = compensated(orthoglide, circle(25.0, 3000), "G61", arcs=False).control
    assert lines.original.seconds < 5.0 and lines.after_s > 10.0
    assert np.linalg.norm(lines.account.latest, axis=1).max() < 1e-3


@pytest.mark.parametrize("mode", ["G64 P0.01", "G64 P0.02 Q0.005"])
def test_lines_are_kept_from_being_made_one(orthoglide, mode):
    """The mode without merging stands in front of the cuts; where the program states its own again, that is answered."""
    lines = [*circle(1.0, 600)[:-1], mode, "G1 X9", "X12 Y0.01", "X15", "X18 Y-0.01", "X21", "G1 Z5"]
    done = compensated(orthoglide, lines, mode, arcs=False)
    apart = mode.partition(" Q")[0] + " Q0"
    text = done.written.data.decode().splitlines()
    assert done.control.apart and done.control.off_joins < 2e-3
    assert any(each.startswith(f"{apart} is written around the cuts") for each in Totals.of(done, orthoglide).warnings)
    assert apart in text[text.index(mode, 5) :] and apart in text[: text.index(mode, 5)]
    read = read_program(done.written.data, name="out.nc", setup=setup_of(orthoglide.config))
    cuts = np.flatnonzero(done.rows.force.any(axis=1) & (done.rows.motion != done.rows.motion[0]))
    assert {read.modes[k].merge_mm for k in cuts if not read.modes[k].exact} <= {0.0, done.program.modes[0].merge_mm}
    assert sum(read.modes[k].merge_mm == 0.0 for k in cuts) > 0.9 * len(cuts)


def test_lines_are_kept_from_being_made_one_with_joining_lines(orthoglide):
    """Cuts of 40 short lines with rapids between them: only at their ends is merging beyond the tolerance."""
    angle = 0.02 * np.arange(300)
    cuts = [f"G1 X{x:.4f} Y{y:.4f} F3000" for x, y in zip(20.0 * np.cos(angle), 20.0 * np.sin(angle), strict=True)]
    lines = [line for k in range(0, 300, 40) for line in ("G1 Z0 F600", *cuts[k : k + 40], "G0 Z2")]
    done = compensated(orthoglide, ["G0 X0 Y0 Z5", *lines], "G64 P0.0005 Q0.01")
    assert done.control.apart and Totals.of(done, orthoglide).summary().under_control.max_um < 1.0


@pytest.mark.parametrize("mode", ["G64 P0.0005", "G64 P0.01 Q0", "G64", ""])
def test_nothing_is_kept_apart_where_nothing_is_made_one(orthoglide, mode):
    done = compensated(orthoglide, circle(1.0, 600), mode, arcs=False)
    assert not done.control.apart and (b"Q0" in done.written.data) == ("Q0" in mode)


def test_a_program_without_any_correction_keeps_its_mode(tmp_path):
    bent = "".join(f"X{0.1 * k:.4f} Y{0.002 * k * k:.4f}\n" for k in range(1, 60))
    lines = f"G64 P0.01\nG0 X0 Y0 Z5\nG1 Z0 F600\n{bent}G1 Z5\n"
    (tmp_path / "p.nc").write_text(HEAD + lines + "M2\n")
    config = [word for each in ("orthoglide", "no-force") for word in ("--config", shipped(f"config/{each}.yaml"))]
    done = camcomp("compensate", tmp_path / "p.nc", *config, "-o", tmp_path / "o.nc")
    assert done.returncode == 0 and b"off the written path" in done.stderr
    assert (tmp_path / "o.nc").read_bytes().partition(b"\n")[2] == (tmp_path / "p.nc").read_bytes()


@pytest.mark.parametrize("arc", ["G3 X15 Y0", "G2 X15 Y0", "G3 X15 Y0 P3", "G2 X0 Y15 P2", "G3 X0 Y15"])
def test_arcs_that_stay_as_programmed_keep_their_turns(arc):
    job = Job(load_config([shipped("config/cartesian.yaml"), shipped("config/no-force.yaml")]))
    done = compensated(job, ["G0 X15 Y0 Z0", f"{arc} I-15 J0 F1200"], "G64 P0.0005\n")
    assert done.control.after_s == pytest.approx(done.control.original.seconds, rel=1e-9)
    assert (
        1e3 * np.linalg.norm(done.control.account.latest, axis=1).max() <= 1.0
    )  # um: what P0.0005 allows for, and its ends


def test_where_the_control_goes_off_is_told_with_its_lines(orthoglide):
    done = compensated(
        orthoglide, ["G0 X0 Y0 Z5", "G1 Z0 F400", "X9 Y0 F3000", "X18 Y0.5", "X27 Y0", "G1 Z5"], "G64 P0.01"
    )
    told = [each for each in Totals.of(done, orthoglide).warnings if "the controller drives" in each]
    assert told and all(each.startswith("in G64 P0.01 the controller drives up to ") for each in told)
    assert "at source line 6;" in told[-1]  # whose corners are rounded
    exact = compensated(orthoglide, rectangle(3000), "G61")
    assert not any("the controller drives" in each for each in Totals.of(exact, orthoglide).warnings)


@pytest.mark.parametrize("mode", ["G61", "G64", "G64 P0.01"])
def test_long_programs_take_the_same_time_and_go_as_far_off(orthoglide, mode, monkeypatch):
    monkeypatch.setattr(under_control, "STRETCH", 100)
    text = "\n".join([HEAD + mode, "S8000 M3", *raster(3000, 2000), "M2", ""]).encode()
    bulk = LongProgram(job=orthoglide, name="p.nc", setup=setup_of(orthoglide.config), tolerance_um=1.0, version="1")
    mine = bulk.run(io.BytesIO(text), len).summary()
    program = program_of(text, "p.nc", orthoglide.config)
    whole = compensate(program, orthoglide, method="newton", tolerance_um=1.0, version="1")
    theirs = Totals.of(whole, orthoglide).summary()
    assert mine.control_mode == theirs.control_mode == mode
    kept_apart = [each for each in mine.warnings if "around the cuts" in each]
    assert kept_apart == [each for each in theirs.warnings if "around the cuts" in each] and bool(kept_apart) == (
        "P" in mode
    )
    assert mine.cycle_time_s.before == pytest.approx(theirs.cycle_time_s.before, rel=1e-6)
    assert mine.cycle_time_s.after == pytest.approx(theirs.cycle_time_s.after, rel=5e-3)
    assert mine.under_control.max_um == pytest.approx(theirs.under_control.max_um, abs=0.1)
    assert mine.under_control.rms_um == pytest.approx(theirs.under_control.rms_um, rel=0.02)


def test_the_control_rests_between_cuts_and_joining_lines(orthoglide):
    """Mode lines enclose joining lines, and the cut next to them stays within the tolerance."""
    done = compensated(orthoglide, circle(25.0, 3000), "G64")
    text = done.written.data.decode().splitlines()
    assert [each for each in text if each.startswith("G6")] == ["G64", "G61", "G64", "G61", "G64"]
    assert done.control.rest.sum() == 4
    assert np.nanmax(sizes(done.control.account.latest[done.control.points.at_join])) <= 1e-3
    assert any(each.startswith("G61 is written at 4 ends") for each in Totals.of(done, orthoglide).warnings)
    read = read_program(done.written.data, name="out.nc", setup=setup_of(orthoglide.config))
    rests = np.flatnonzero([mode.exact for mode in read.modes])
    joins = np.flatnonzero(done.rows.joining)
    assert rests.tolist() == sorted({*joins.tolist(), *(joins - 1).tolist()})


@pytest.mark.parametrize("text", ["G20\nG64 P0.001\n", "G64 P0.02 Q0\n"])
def test_behind_a_joining_line_the_program_s_own_mode_is_in_force_again(orthoglide, text):
    k = 25.4 if "G20" in text else 1.0
    lines = [
        f"G0 X{20 / k:.4f} Y0 Z{5 / k:.4f}",
        f"G1 Z0 F{400 / k:.1f}",
        f"G1 X{-20 / k:.4f} F{900 / k:.2f}",
        f"G1 Z{5 / k:.4f}",
    ]
    done = compensated(orthoglide, lines, text.strip())
    read = read_program(done.written.data, name="out.nc", setup=setup_of(orthoglide.config))
    own = done.program.modes[0]
    assert {mode for mode in read.modes if not mode.exact} == {own} and any(mode.exact for mode in read.modes)


def test_a_program_without_a_stated_mode_gets_none(orthoglide):
    done = compensated(orthoglide, rectangle(3000))
    assert b"G61" not in done.written.data and done.control.rest.sum() == 0


@pytest.mark.parametrize(
    ("lines", "seconds", "dialect"),
    [
        ("G4 P1.5\nG1 X5\nG4 P0.25\n", 1.75, "rs274"),
        ("T1 M6\nG1 X5\nT2 M6\nG4 P1\n", 17.0, "rs274"),
        ("G82 X0 Y0 Z-1 R2 P0.5 F200\nX5\nG80\n", 1.0, "rs274"),
        ("o1 repeat [3]\nG4 P2\no1 endrepeat\n", 6.0, "rs274"),
        ("G4 P1500\nG4 X0.5\n", 2.0, "fanuc"),
        ("G4 F1.5\nS60 M3\nG4 S2\n", 3.5, "sinumerik"),
        ("M0\nM8\nG1 X5\n", 0.0, "rs274"),
    ],
)
def test_pauses_and_tool_changes_are_part_of_the_cycle_time(lines, seconds, dialect):
    job = job_of("cartesian", dialect=dialect, tool_change_s=8.0)
    head = "G90\n" if dialect == "sinumerik" else HEAD
    program = program_of((head + "G0 X0 Y0 Z3\nG1 Z2 F100\n" + lines + "M30\n").encode(), "p.nc", job.config)
    assert waiting_s(job.config, program.dwelt_s, program.tool_changes) == pytest.approx(seconds)


def test_long_programs_wait_as_long(monkeypatch, orthoglide):
    text = "\n".join([HEAD + "T1 M6 G4 P2", "S8000 M3", *raster(3000, 300), "G4 P0.5", "M2", ""]).encode()
    job = job_of(tool_change_s=8.0)
    with_waits, without = (
        LongProgram(job=each, name="p.nc", setup=setup_of(each.config), tolerance_um=1.0, version="1")
        .run(io.BytesIO(what), len)
        .summary()
        .cycle_time_s
        for each, what in (
            (job, text),
            (job, text.replace(b"G4 P2", b"").replace(b"G4 P0.5", b"").replace(b"T1 M6", b"")),
        )
    )
    assert with_waits.before - without.before == pytest.approx(10.5)
    assert with_waits.after - without.after == pytest.approx(10.5)


@pytest.mark.parametrize("cut", ["G4 P0.1 G1 X7", "G4 P0.1\nX7", "S9000 X7", "G91 S9000 G1 X1\nG90"])
def test_the_control_waits_where_the_written_program_says(orthoglide, cut):
    """A joining line in front of a block with a dwell comes before the dwell, behind a dwell of its own after it."""
    done = compensated(orthoglide, ["G0 X0 Y0 Z3", "G1 X5 F100", "X6 Y1", *cut.split("\n"), "Z5"], arcs=False)
    assert done.rows.joining.any()
    text = program_of(done.written.data, "out.nc", orthoglide.config)
    assert done.control.written.waits.tolist() == np.asarray(text.path.waits).tolist()
    told, mine = verify(text, done.program, orthoglide).figures(1.0), Totals.of(done, orthoglide).summary()
    assert told.under_control.max_um == pytest.approx(mine.under_control.max_um, rel=0.01)


@pytest.mark.parametrize("mode", ["G61", "G64 P0.01"])
def test_verify_repeats_what_the_control_makes_of_it(orthoglide, mode):
    """Its points lie closer than those of the summary and count the residual across the path only."""
    done = compensated(orthoglide, ["G4 P3", *circle(25.0, 3000)], mode, arcs=False)
    text = program_of(done.written.data, "out.nc", orthoglide.config)
    told, mine = verify(text, done.program, orthoglide).figures(1.0), Totals.of(done, orthoglide).summary()
    assert told.control_mode == mine.control_mode == mode and told.control_mode_stated
    assert told.cycle_time_s.before == pytest.approx(mine.cycle_time_s.before) and told.cycle_time_s.before > 3.0
    assert told.cycle_time_s.after == pytest.approx(mine.cycle_time_s.after, rel=1e-4)
    assert told.under_control.max_um == pytest.approx(mine.under_control.max_um, rel=0.1, abs=0.2)
    assert told.under_control.rms_um == pytest.approx(mine.under_control.rms_um, rel=0.02)
    assert 1.0 > told.under_control.max_um > 0.5


def test_verify_says_so_in_text_and_json(tmp_path):
    (tmp_path / "p.nc").write_text(HEAD + "G64 P0.01\nG0 X0 Y0 Z0\nG1 X9 F100\nG4 P2\nM2\n")
    config = ("--config", shipped("config/cartesian.yaml"))
    assert camcomp("compensate", tmp_path / "p.nc", *config, "-o", tmp_path / "o.nc").returncode == 0
    waits_longer = tmp_path / "longer.nc"
    waits_longer.write_text((tmp_path / "p.nc").read_text().replace("G4 P2", "G4 P7"))
    words = ("--against", waits_longer, *config, "--json", tmp_path / "v.json")
    done = camcomp("verify", tmp_path / "o.nc", *words)
    figures = json.loads((tmp_path / "v.json").read_text())
    schemas.check("verify", figures)
    before, after = (figures["cycle_time_s"][each] for each in ("before", "after"))
    assert before - after == pytest.approx(5.0, abs=0.1)
    assert done.returncode == 0 and f"cycle time {after:.1f} s, before {before:.1f} s".encode() in done.stderr
    assert figures["cycle_time_s"]["after"] > 2.0 and set(figures["under_control"]) == {"rms_um", "max_um"}


def test_long_programs_keep_lines_apart_where_they_begin_to_merge(orthoglide):
    begin, groove, end = (circle(1.0, 600)[:2], circle(1.0, 600)[2], circle(1.0, 600)[3])
    lines = [*begin, groove, groove, "G64 P0.01", groove, groove, end]
    text = "\n".join([HEAD + "G61", "S8000 M3", *lines, "M2", ""]).encode()
    out = []
    LongProgram(job=orthoglide, name="p.nc", setup=setup_of(orthoglide.config), tolerance_um=1.0, version="1").run(
        io.BytesIO(text), out.append
    )
    said = [each for each in b"".join(out).decode().splitlines() if each.startswith("G6")]
    assert said[:3] == ["G61", "G64 P0.01", "G64 P0.01 Q0"]
