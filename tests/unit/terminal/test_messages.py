"""Printed lines state the result and the possible action, in one reading."""

import json
import sys
from types import SimpleNamespace

import pytest

from camcomp.api import diagnosis
from camcomp.compensation.program.under_control import FarOff, control_warnings
from camcomp.compensation.report.page import _caution
from camcomp.gcode.interpret import read_program
from camcomp.ground.files import shipped
from camcomp.ground.source_lines import named_lines
from camcomp.terminal.cli import run
from camcomp.terminal.commands import _figures
from camcomp.terminal.commands.compensate import _either

CARTESIAN = ("--config", str(shipped("config/cartesian.yaml")))
SQUARE = "G21 G90 G17 G94\nT1 M6\nG43 H1\nS8000 M3\nG0 X0 Y0 Z5\nG1 Z0 F300\nG1 X10 F600\nG1 Y10\nX0\nY0\nG0 Z5\nM30\n"


def resting(count):
    """Warnings about exact stops at so many ends."""
    return control_warnings((), FarOff(), FarOff(), exact_stop="G61", resting=count, apart=())


@pytest.fixture
def compensated(tmp_path, capfd):
    """What compensate prints of the square, and its summary."""
    (tmp_path / "p.nc").write_text(SQUARE)

    def call(yaml=""):
        (tmp_path / "more.yaml").write_text(yaml)
        more = ("--config", str(tmp_path / "more.yaml")) if yaml else ()
        outputs = ("-o", str(tmp_path / "o.nc"), "--summary", str(tmp_path / "s.json"))
        assert run(["compensate", str(tmp_path / "p.nc"), *CARTESIAN, *more, *outputs]) == 0
        return capfd.readouterr().err, json.loads((tmp_path / "s.json").read_text()), (tmp_path / "o.nc").read_bytes()

    return call


def test_compensate_counts_lines_and_says_what_to_state(compensated):
    said, figures, written = compensated()
    assert f"12 lines become {len(written.splitlines())}\n" in said and figures["lines_in"] == 12
    assert "5 joining lines where the cutting force jumps; not counted in the tip error\n" in said
    assert not [each for each in figures["warnings"] if "joining" in each]
    assert "drives in G64 (assumed): tip error" in said and "`control: {path_mode: G64 P0.01}`" in said
    assert "warning: " in said and "tool 1 has no length in `control: tool_lengths_mm`" in said
    assert "platform tilt" not in said  # this machine has none


def test_a_stated_mode_needs_no_hint(compensated):
    said, _, _ = compensated("control: {path_mode: G61, tool_lengths_mm: {1: 0}}\n")
    assert "path_mode" not in said and "warning" not in said


def test_numbers_without_a_point_say_both_readings(compensated):
    said, _, _ = compensated("control: {dialect: fanuc}\n")
    assert "X10 as 10 mm; a controller that counts increments reads 0.01 mm" in said
    assert "`control: {input_increment_mm: 0.001}`" in said


def test_expected_errors_name_the_stated_spreads():
    size = SimpleNamespace(rms_um=3.0, rms_ci95_um=(1.0, 5.0), p95_um=6.0)
    first, second = _figures.expected_error_lines(SimpleNamespace(expected=size, advice="cut two slots"))
    assert first.startswith("expected on a machine within the stated spreads: rms 3.00 um (95 %: 1.00 to 5.00)")
    assert second == "cut two slots" and _figures.expected_error_lines(SimpleNamespace(expected=None)) == []


@pytest.mark.parametrize(
    ("terminal", "words", "shown"), [(True, (), ""), (False, (), "{}"), (True, ("--json", "-"), "{}")]
)
def test_diagnose_prints_json_where_asked_or_into_a_pipe(monkeypatch, capfd, terminal, words, shown):
    done = SimpleNamespace(notes=(), result=SimpleNamespace(to_json=lambda: b"{}"), configs=(), answer=["none: ..."])
    monkeypatch.setattr(diagnosis, "diagnose", lambda *_, **__: done)
    monkeypatch.setattr(sys.stdout, "isatty", lambda: terminal, raising=False)
    assert run(["diagnose", "experiment.yaml", *words]) == 0
    out, err = capfd.readouterr()
    assert out == shown and "none: ..." in err


def test_a_report_that_passes_by_its_model_alone_says_so():
    def figures(under, stated):
        return SimpleNamespace(
            under_control=SimpleNamespace(max_um=under), after=SimpleNamespace(max_um=0.9),
            control_mode="G64", control_mode_stated=stated,
        )  # fmt: skip

    assert _caution(figures(0.9, False), 1.0) == ""
    assert "up to 95" in _caution(figures(95.0, False), 1.0) and "path_mode" in _caution(figures(95.0, False), 1.0)
    assert "see the warnings" in _caution(figures(95.0, True), 1.0)


def test_rounding_errors_of_zero_are_printed_as_zero():
    assert _either((5.027e-88, "N", 1.0), (None, "N m", 1e-3)) == "0"
    assert _either((330.94, "N", 1.0), (1e-12, "N m", 1e-3)) == "330.9 N"
    assert _either((None, "N", 1.0), (1.8811e6, "N m", 1e-3)) == "1881 N m"


def test_exact_stops_that_were_written_need_no_action():
    (said,) = resting(1)
    assert (
        said
        == "G61 is written at 1 end of cuts and joining lines: the controller stops there instead of rounding; nothing to do"
    )
    assert "at 2 ends" in resting(2)[0] and resting(0) == []


def test_messages_name_one_line_in_the_singular_and_at_most_ten():
    assert named_lines([4]) == "source line 4" and named_lines([4, 5]) == "source lines 4, 5"
    assert named_lines(list(range(11))) == "source lines 0, 1, 2, 3, 4, 5, 6, 7, 8, 9 ..."


def test_warnings_that_need_no_action_are_notes():
    assert _figures.warning_lines([*resting(1), "cut"])[0].startswith("note: G61 is written at 1 end")
    assert _figures.warning_lines(["cut"]) == ["warning: cut"]


def test_numbers_without_a_point_in_inch_say_inch():
    program = read_program(b"%\nO1\nG20\nG0 X0. Y0. Z0.\nG1 X10 F10\nM30\n%\n", name="p.nc", dialect="fanuc")
    assert any(
        "X10 as 10 inch; a controller that counts increments reads 0.001 inch" in each for each in program.warnings
    )


def test_verify_says_that_a_program_was_never_compensated(tmp_path, capfd):
    part = tmp_path / "part.nc"
    part.write_text("G21 G90\nG0 X0 Y0 Z0\nG1 X10 F1000\nM30\n")
    assert run(["verify", str(part), "--against", str(part), *CARTESIAN]) == 1
    assert "at source line 3\n  hint: the program has no stamp" in capfd.readouterr().err
