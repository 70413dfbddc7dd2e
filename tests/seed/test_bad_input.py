"""Bad programs and bad machine files: refused with place, rule and hint, the right exit code, and nothing written."""

import re

import pytest

from camcomp.terminal.cli import run

GOOD = "G21 G90 G17 G94\nG0 X5 Y0 Z5\nG1 Z0 F300\nG1 X9 F600\nM30\n"
MACHINE = "config/orthoglide-1deg.yaml"

BAD_PROGRAMS = {
    "unreachable": ("G21 G90\nG0 X0 Y0 Z5\nG1 X900 F600\n", 4, "CC302", 3),
    "cutter compensation left": ("G21 G90\nG0 X0 Y0 Z5\nG41 D1\nG1 X9 F600\n", 3, None, 3),
    "cutter compensation right": ("G21 G90\nG0 X0 Y0 Z5\nG42 D1\nG1 X9 F600\n", 3, None, 3),
    "not a number": ("G21 G90\nG0 X0 Y0 Z5\nG1 Xnan F600\n", 3, None, 3),
    "nothing in it": ("", 3, None, 1),
    "only a comment": ("(nothing)\n", 3, None, 1),
    "arc that does not close": ("G21 G90\nG0 X0 Y0 Z0\nG2 X10 Y0 I3 J0 F600\n", 3, None, 3),
    "rotary axis": ("G21 G90\nG0 X0 Y0 Z5\nG1 X9 A10 F600\n", 3, None, 3),
    "decimal comma": ("G21 G90\nG0 X0 Y0 Z5\nG1 X1,5 F600\n", 3, None, 3),
    "spline": ("G21 G90\nG0 X0 Y0 Z5\nG5 X9 Y9 I1 J1 P1 Q1 F600\n", 3, None, 3),
}

BAD_MACHINES = {
    "unknown key": ("workpiece: {orgin_mm: [0, 0, 0]}\n", "origin_mm"),
    "unit missing": ("tool: {length: 100}\n", "length_mm"),
    "not a number": ("tool: {length_mm: .nan}\n", None),
    "syntax": ("tool: {length_mm: 100\n", None),
    "twice": ("tool: {length_mm: 100}\ntool: {length_mm: 90}\n", None),
    "not positive definite": (
        (
            "robot:\n  name: m\n  chains:\n    x:\n      elements:\n"
            "        - {type: actuator, joint: prismatic, axis: x}\n"
            "        - type: link\n          stiffness_mm_N_rad:\n"
            "            - [1, 2, 0, 0, 0, 0]\n            - [2, 1, 0, 0, 0, 0]\n            - [0, 0, 1, 0, 0, 0]\n"
            "            - [0, 0, 0, 1, 0, 0]\n            - [0, 0, 0, 0, 1, 0]\n            - [0, 0, 0, 0, 0, 1]\n"
        ),
        None,
    ),
    "negative stiffness": (
        (
            "robot:\n  name: m\n  chains:\n    x:\n      elements:\n"
            "        - {type: actuator, joint: prismatic, axis: x, stiffness_N_per_mm: -5}\n"
        ),
        None,
    ),
}


def refused(capsys, tmp_path, words):
    """Exit code and message of a compensation without output."""
    outputs = [tmp_path / name for name in ("out.nc", "joints.csv", "paths.csv", "summary.json")]
    options = ["-o", "--joints", "--paths", "--summary"]
    code = run(["compensate", *words, *(str(w) for pair in zip(options, outputs, strict=True) for w in pair)])
    assert not any(path.exists() for path in outputs)
    shown = capsys.readouterr()
    assert shown.out == ""
    return code, shown.err


@pytest.mark.parametrize("name", BAD_PROGRAMS)
def test_bad_programs(capsys, tmp_path, name):
    text, exit_code, rule, line = BAD_PROGRAMS[name]
    program = tmp_path / "bad.nc"
    program.write_text(text)
    code, message = refused(capsys, tmp_path, [str(program), "--config", MACHINE])
    assert code == exit_code, message
    assert re.search(rf"bad\.nc:{line}:\d+: error\[{rule or 'CC1[0-9][0-9]'}\]: ", message), message
    assert "hint:" in message


@pytest.mark.parametrize("name", BAD_MACHINES)
def test_bad_machine_files(capsys, tmp_path, name):
    text, suggestion = BAD_MACHINES[name]
    program, machine = tmp_path / "good.nc", tmp_path / "machine.yaml"
    program.write_text(GOOD)
    machine.write_text(text)
    code, message = refused(capsys, tmp_path, [str(program), "--config", MACHINE, "--config", str(machine)])
    assert code == 2, message
    assert re.search(r"machine\.yaml:\d+:\d+: error\[CC2\d\d\]: ", message), message
    assert suggestion is None or suggestion in message


def test_a_load_that_the_machine_cannot_carry_is_reported(capsys, tmp_path):
    program, machine = tmp_path / "good.nc", tmp_path / "force.yaml"
    program.write_text(GOOD)
    machine.write_text("process: {force: {model: constant, Fr_N: 3.0e+6, Ft_N: 0, Fz_N: 0}}\n")
    code, message = refused(capsys, tmp_path, [str(program), "--config", MACHINE, "--config", str(machine)])
    assert code == 4 and re.search(r"good\.nc:4:\d+: error\[CC30[1-4]\]", message), message


def test_the_input_is_never_overwritten(capsys, tmp_path):
    program = tmp_path / "good.nc"
    program.write_text(GOOD)
    assert run(["compensate", str(program), "--config", MACHINE, "-o", str(program)]) == 5
    assert program.read_text() == GOOD
