"""Set-points in, corrections out: the same as the whole-program solver gives, one line for every line."""

import csv
import gc
import io
import json
import os
import signal
import subprocess
import sys

import numpy as np
import pytest

from camcomp.compensation.set_points.lines import AnswerWriter, Reader
from camcomp.compensation.set_points.stream import Stream
from camcomp.effects import tool_deflection
from camcomp.ground.errors import ConfigError, PhysicsError
from camcomp.ground.files import shipped
from camcomp.model.config.load import load_config
from camcomp.model.job import Job
from camcomp.model.statics.target import correct
from camcomp.terminal.cli import run
from tests.commandline import ROOT, camcomp

MACHINE = "config/orthoglide-1deg.yaml"
LINE = "25,0,0,215,-10,-25"


@pytest.fixture(scope="module")
def job():
    return Job(load_config([shipped(MACHINE)]))


@pytest.fixture(scope="module")
def stream(job):
    return Stream(job)


# --- points -----------------------------------------------------------------------------------------------------------


def test_points_are_those_of_the_solver_for_whole_programs(job, stream):
    a = np.linspace(0.0, 1.0, 7)
    tip = np.column_stack((25.0 * np.cos(a), 25.0 * np.sin(a), -a))
    force = np.column_stack((215.0 * np.cos(a), 215.0 * np.sin(a), -25.0 * a))
    exact = correct(job.machine, job.frame.to_machine(tip), force)
    for i in range(len(a)):
        point = stream.correct(tip[i], force[i])
        assert point.commanded == pytest.approx(job.frame.to_program(exact.commanded)[i], abs=1e-6)
        assert point.nominal == pytest.approx(exact.rho_nominal[i], abs=1e-6)
        assert point.actuators == pytest.approx(exact.rho[i], abs=1e-6)
        assert point.drive == pytest.approx(exact.drive[i], abs=1e-3)
        assert point.beyond == ()


def test_a_point_out_of_reach_is_refused_and_the_next_one_is_solved(stream):
    good = stream.correct((1.0, 2.0, 3.0), (10.0, 0.0, 0.0))
    with pytest.raises(PhysicsError) as error:
        stream.correct((5000.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    assert error.value.rule == "CC302"
    again = stream.correct((1.0, 2.0, 3.0), (10.0, 0.0, 0.0))
    assert again.commanded == pytest.approx(good.commanded, abs=1e-9)


def test_actuators_outside_their_travel_are_named(tmp_path):
    narrow = tmp_path / "narrow.yaml"
    narrow.write_text(
        "robot: {name: c, source: test, chains: {xyz: {elements: ["
        "{type: actuator, name: x, joint: prismatic, axis: x, stiffness_N_per_mm: 1.0e+4, limits_mm: [-1, 1], source: t},"
        "{type: actuator, name: y, joint: prismatic, axis: y, stiffness_N_per_mm: 1.0e+4, limits_mm: [-9, 9], source: t},"
        "{type: actuator, name: z, joint: prismatic, axis: z, stiffness_N_per_mm: 1.0e+4, limits_mm: [-9, 9], source: t}"
        "]}}}\nworkpiece: {origin_mm: [0, 0, 0]}\ntool: {length_mm: 0}\n"
        "process: {force: {model: none}}\ncontrol: {resolution_mm: 0.001}\n"
    )
    point = Stream(Job(load_config([narrow]))).correct((0.95, 0.0, 0.0), (-1000.0, 0.0, 0.0))
    assert point.commanded[0] == pytest.approx(1.05, abs=2e-6)  # 1000 N on 10 000 N/mm
    assert point.beyond == ("x",)


def test_effects_of_the_config_take_part(job, tmp_path):
    more = tmp_path / "effects.yaml"
    more.write_text(
        "effects:\n  - {effect: tool_deflection, target: null, compliance_mm_per_N: 1.0e-4}\n"
        "  - {effect: backlash, target: x, width_mm: 0.04}\n"
    )
    bent = Stream(Job(load_config([shipped("config/cartesian.yaml"), more])))
    bent.correct((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    there = bent.correct((5.0, 0.0, 0.0), (100.0, 0.0, 0.0)).commanded[0]
    back = bent.correct((4.0, 0.0, 0.0), (100.0, 0.0, 0.0)).commanded[0] + 1.0
    assert there + back == pytest.approx(10.0 - 2 * 100 * (1e-4 + 1 / 2e4), abs=1e-5)
    assert abs(there - back) == pytest.approx(0.04, abs=1e-5)


# --- lines ------------------------------------------------------------------------------------------------------------


ORDER = "t_s,fz_N,fy_N,fx_N,z_mm,y_mm,x_mm"
JSON_LINE = '{"x_mm":1,"y_mm":2,"z_mm":3,"fx_N":4,"fy_N":5,"fz_N":6}'


def read(text, *before):
    reader = Reader()
    for each in before:
        assert reader.read(f"{each}\n".encode()) is None
    return reader.read(f"{text}\n".encode())


def answers(reader, *lines):
    """For every line the force along x that was read, None for a header, or its error."""
    out = []
    for line in lines:
        try:
            point = reader.read(line if isinstance(line, bytes) else f"{line}\n".encode())
            out.append(point and point.force[0])
        except ConfigError as error:
            assert error.rule == "CC270"
            out.append(error.message)
    return out


def test_lines_of_both_kinds_are_read():
    plain = read("1,2,3,4,5,6\n")
    assert (plain.tip, plain.force, plain.time) == ((1.0, 2.0, 3.0), (4.0, 5.0, 6.0), None)
    assert read(" 1, 2 ,3,4,5,6,0.5\r\n").time == 0.5
    assert read('{"x_mm":1,"y_mm":2,"z_mm":3,"fx_N":4,"fy_N":5,"fz_N":6.0}') == plain
    assert read('{"t_s":9,"x_mm":1,"y_mm":2,"z_mm":3,"fx_N":4,"fy_N":5,"fz_N":6}').time == 9.0
    assert read("9,6,5,4,3,2,1", "t_s,fz_N,fy_N,fx_N,z_mm,y_mm,x_mm").tip == (1.0, 2.0, 3.0)
    assert read('"1","2","3","4","5","6"') == plain


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("1,2,3,4,5", "5 columns"),
        ("1,2,3,4,5,6,7,8", "8 columns"),
        ("1,2,3,4,5,x y", "'x y' is not a number"),
        ("1,,3,4,5,6", "'' is not a number"),
        ("", "the line is empty"),
        (" \r", "the line is empty"),
        ("1,2,3,4,5,nan", "'nan' is not a number"),
        ("inf,2,3,4,5,6", "'inf' is not a number"),
        ("1_0,2,3,4,5,6", "'1_0' is not a number"),
        ("1,2,3,4,5,\uff16", "is not a number"),
        ("1,2,3,4,5,0x10", "'0x10' is not a number"),
        ("1,2,3,4,5,1e999", "larger than"),
        ('"1e999",2,3,4,5,6', "'1e999' is not a number"),
        ("1e308,1e308,3,4,5,6", "larger than"),
        ("#1,2,3,4,5,6", "'1' is none of"),
        ("x_mm,y_mm", "z_mm is missing"),
        ("x_mm,y_mm,z_mm,fx_N,fy_N,fz_N,colour", "'colour' is none of"),
        ("x_mm,y_mm,z_mm,fx_N,fy_N,fz_N,x_mm", "twice"),
        ('{"x_mm":1}', "y_mm is missing"),
        ('{"x_mm":true,"y_mm":2,"z_mm":3,"fx_N":4,"fy_N":5,"fz_N":6}', "x_mm is not a number"),
        ('{"x_mm":1e999,"y_mm":2,"z_mm":3,"fx_N":4,"fy_N":5,"fz_N":6}', "larger than"),
        ('{"x_mm":NaN,"y_mm":2,"z_mm":3,"fx_N":4,"fy_N":5,"fz_N":6}', "NaN is not a number"),
        ('{"x_mm":1,"y_mm":2,"z_mm":3,"fx_N":4,"fy_N":5,"fz_N":6,"x_mm":7}', "twice"),
        ('{"x_mm":[1],"y_mm":2,"z_mm":3,"fx_N":4,"fy_N":5,"fz_N":6}', "x_mm is not a number"),
        ('{"x_mm":1,', "no JSON"),
        ("[" * 50_000, "is none of"),
        ('{"a":' * 10_000, "no JSON"),
    ],
)
def test_what_cannot_be_read_is_refused(line, message):
    with pytest.raises(ConfigError, match=message) as error:
        read(line)
    assert error.value.rule == "CC270"


@pytest.mark.parametrize(
    "header",
    [
        ORDER,
        '"' + ORDER.replace(",", '","') + '"',
        "\ufeff" + ORDER,
        "# " + ORDER.replace(",", ", "),
        '#"' + ORDER.replace(",", '", "') + '"\r',
        "," + ORDER,
        '"","' + ORDER.replace(",", '","') + '"',
    ],
)
def test_headers_are_read_as_others_write_them(header):
    index = "0," if header.lstrip('"').startswith((",", '",')) else ""
    assert answers(Reader(), header, f"{index}9,6,5,-10,3,2,1") == [None, -10.0]


def test_what_python_writes_is_read():
    out = io.StringIO()
    csv.writer(out, quoting=csv.QUOTE_ALL).writerows([ORDER.split(","), [9, 6, 5, -10, 3, 2, 1]])
    assert answers(Reader(), *out.getvalue().encode().splitlines(keepends=True)) == [None, -10.0]


@pytest.mark.parametrize(
    "header",
    [
        "x_mm,y_mm,z_mm,fx_N,fy_N,force",
        "x,y,z,fx,fy,fz",
        "hello",
        '"x_mm","y_mm","z_mm,fx_N',
        "x_mm;y_mm;z_mm;fx_N;fy_N;fz_N",
        b"\xff\xfex\0_\0m\0m\0\n",
        ",0,1,2,3,4,5",
        "# exported",
    ],
)
def test_rows_below_a_bad_header_are_refused_until_a_good_one_comes(header):
    reader = Reader()
    first, *rows = answers(reader, header, "1,2,3,-10,5,6", "1,2,3,-10,5,6,7")
    assert first and all("header" in each for each in rows)
    assert answers(reader, JSON_LINE) == [4.0]  # says itself what is what
    assert answers(reader, ORDER, "9,6,5,-10,3,2,1") == [None, -10.0]


def test_nothing_behind_the_first_row_changes_the_order_and_one_word_ends_nothing():
    reader = Reader()
    told = answers(reader, ORDER, "9,6,5,4,3,2,1", "hello", ORDER, "9,6,5,4,3,2,1")
    assert told[0] is None and told[1] == told[4] == 4.0 and "hello" in told[2] and "behind the first row" in told[3]
    other, row, again = answers(reader, "x_mm,y_mm,z_mm,fx_N,fy_N,fz_N,t_s", "1,2,3,4,5,6,7", "1,2,3,4,5,6,7")
    assert "other columns" in other and "header" in row and "header" in again
    assert [type(each) for each in answers(Reader(), "nan,2,3,4,5,6", LINE, "hello", LINE)] == [str, float, str, float]
    assert [type(each) for each in answers(Reader(), ORDER, "hello", "9,6,5,4,3,2,1")][1:] == [str, float]


def test_columns_told_beforehand():
    assert answers(Reader(ORDER), "9,6,5,4,3,2,1", "hello", "9,6,5,4,3,2,1")[::2] == [4.0, 4.0]
    assert answers(Reader(ORDER), "hello", "9,6,5,4,3,2,1")[1] == 4.0
    assert answers(Reader(ORDER), ORDER, "9,6,5,4,3,2,1") == [None, 4.0]
    assert all(isinstance(each, str) for each in answers(Reader(ORDER), ORDER[4:] + ",t_s", "9,6,5,4,3,2,1"))
    with pytest.raises(ConfigError, match="fz_N is missing"):
        Reader("x_mm,y_mm,z_mm,fx_N,fy_N")


def test_a_line_without_its_end_may_be_half_a_line():
    assert answers(Reader(), b"25,0,0,215,-10,-2") == ["the line has no end, so the rest of it may be lost"]
    assert "no end" in answers(Reader(), JSON_LINE.encode())[0]


def test_answers_hold_one_line_with_every_column():
    point = read("1,2,3,4,5,6,0.25")
    for as_json in (False, True):
        writer = AnswerWriter(["xc_mm", "act_x_N"], as_json)
        good = writer.good(point, [7.0, -8.0])
        bad = writer.bad(3, "CC270", 'a "quoted",\nbroken text')
        assert good.count("\n") == bad.count("\n") == 1
        if as_json:
            assert json.loads(good)["act_x_N"] == -8.0 and json.loads(good)["t_s"] == 0.25
            assert json.loads(bad)["line"] == 3
        else:
            rows = list(csv.DictReader(io.StringIO(writer.header + good + bad)))
            assert float(rows[0]["act_x_N"]) == -8.0 and rows[0]["error"] == ""
            assert rows[1]["xc_mm"] == "" and rows[1]["error"].startswith("line 3: CC270")


# --- the verb ---------------------------------------------------------------------------------------------------------


def test_every_line_is_answered_and_errors_do_not_stop_it(job, stream):
    lines = [LINE, "nonsense here", "9000,0,0,0,0,0", LINE]
    done = camcomp("stream", "--config", MACHINE, stdin="".join(f"{line}\n" for line in lines).encode())
    assert done.returncode == 1, done.stderr.decode()
    rows = list(csv.DictReader(io.StringIO(done.stdout.decode())))
    assert [row["error"] != "" for row in rows] == [False, True, True, False]
    assert "CC270" in rows[1]["error"] and "CC302" in rows[2]["error"]
    assert rows[0] == rows[3]
    point = stream.correct((25.0, 0.0, 0.0), (215.0, -10.0, -25.0))
    for axis, value in zip("xyz", point.commanded, strict=True):
        assert float(rows[0][f"{axis}c_mm"]) == pytest.approx(value, abs=2e-6)
    for name, q, f in zip("xyz", point.actuators, point.drive, strict=True):
        assert float(rows[0][f"act_{name}_mm"]) == pytest.approx(q, abs=2e-6)
        assert float(rows[0][f"act_{name}_N"]) == pytest.approx(f, abs=2e-3)
    assert b"2 set-points" in done.stderr and b"2 lines with an error" in done.stderr


def test_json_answers(job):
    given = '{"t_s": 1.5, "x_mm": 1, "y_mm": 2, "z_mm": 0, "fx_N": 0, "fy_N": 0, "fz_N": 0}\n'
    done = camcomp("stream", "--json", "--config", MACHINE, stdin=given.encode())
    assert done.returncode == 0, done.stderr.decode()
    (record,) = [json.loads(line) for line in done.stdout.decode().splitlines()]
    assert record["t_s"] == 1.5 and record["x_mm"] == 1.0 and "error" not in record
    assert abs(record["xc_mm"] - 1.0) > 1e-3  # the chain errors alone move the tip


def served(text, *options):
    """Answer lines and standard error of one stream, in this process."""
    saved = sys.stdin, sys.stdout, sys.stderr
    sys.stdin, sys.stdout, sys.stderr = (
        io.TextIOWrapper(io.BytesIO(text)),
        io.TextIOWrapper(io.BytesIO()),
        io.StringIO(),
    )
    try:
        run(["stream", "--config", str(shipped("config/cartesian.yaml")), *options])
        return sys.stdout.buffer.getvalue().decode().splitlines(), sys.stderr.getvalue()
    finally:
        sys.stdin, sys.stdout, sys.stderr = saved
        gc.unfreeze()


def test_as_many_answers_as_lines_in_their_order():
    rows = [LINE, "", "hello", f"{LINE},7", "nan,0,0,0,0,0", "\u00e9\ud800x", "9" * 70_000, JSON_LINE, "{}", " "]
    text = "\n".join(rows).encode("utf-8", "surrogatepass") + b"\n25,0"
    wrong = [False, True, True, False, True, True, True, False, True, True, True]
    told, said = served(text)
    assert [row["error"] != "" for row in csv.DictReader(told)] == wrong and "8 lines with an error" in said
    told, _ = served(text, "--json")
    assert ["error" in json.loads(line) for line in told] == wrong
    assert [json.loads(line).get("line", 0) for line in told] == [0, 2, 3, 0, 5, 6, 7, 0, 9, 10, 11]
    header = ORDER.encode() + b"\n9,6,5,4,3,2,1\n"
    told, _ = served(header, "--json")
    assert json.loads(told[0]) == {"columns": ORDER.split(",")} and json.loads(told[1])["fx_N"] == 4.0
    assert len(served(header)[0]) == 2  # the header of the answers answers the header
    assert json.loads(served(b"9,6,5,4,3,2,1\n", "--json", "--columns", ORDER)[0][0])["fx_N"] == 4.0
    name = b'{"\\ud800": 1}\n'  # half a character in an error message
    assert len(served(name)[0]) == 2


def test_a_supervisor_ends_the_stream_and_is_told_what_was_done():
    command = [sys.executable, "-m", "camcomp", "stream", "--config", MACHINE]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    with subprocess.Popen(command, cwd=ROOT, env={**os.environ, "PYTHONPATH": str(ROOT)}, **pipes) as process:
        process.stdin.write(f"{LINE}\n".encode())
        process.stdin.flush()
        assert process.stdout.readline() and process.stdout.readline()
        process.terminate()
        assert process.wait(10) == 128 + signal.SIGTERM
        said = process.stderr.read()
    assert b"1 set-point," in said and b"0 lines with an error" in said and b"Traceback" not in said


def test_what_is_no_number_is_no_answer(monkeypatch, tmp_path):
    more = tmp_path / "effects.yaml"
    more.write_text("effects:\n  - {effect: tool_deflection, compliance_mm_per_N: 1.0e-4}\n")
    bent = Stream(Job(load_config([shipped("config/cartesian.yaml"), more])))
    monkeypatch.setattr(tool_deflection, "on_pose", lambda tip, load, motion, values: tip * np.nan)
    with pytest.raises(PhysicsError, match="effect 'tool_deflection'") as error:
        bent.correct((5.0, 0.0, 0.0), (100.0, 0.0, 0.0))
    assert error.value.exit_code == 4
