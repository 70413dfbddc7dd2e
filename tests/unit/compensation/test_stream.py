"""Set-points in, corrections out: the same as the whole-program solver gives, one line for every line."""

import csv
import io
import json

import numpy as np
import pytest

from camcomp.compensation.set_points.lines import AnswerWriter, Reader
from camcomp.compensation.set_points.stream import Stream
from camcomp.ground.errors import ConfigError, PhysicsError
from camcomp.ground.files import shipped
from camcomp.model.config.load import load_config
from camcomp.model.job import Job
from camcomp.model.statics.target import correct
from tests.commandline import camcomp

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


def read(text, *before):
    reader = Reader()
    for each in before:
        assert reader.read(each.encode()) is None
    return reader.read(text.encode())


def test_lines_of_both_kinds_are_read():
    plain = read("1,2,3,4,5,6\n")
    assert (plain.tip, plain.force, plain.time) == ((1.0, 2.0, 3.0), (4.0, 5.0, 6.0), None)
    assert read(" 1, 2 ,3,4,5,6,0.5\r\n").time == 0.5
    assert read('{"x_mm":1,"y_mm":2,"z_mm":3,"fx_N":4,"fy_N":5,"fz_N":6.0}') == plain
    assert read('{"t_s":9,"x_mm":1,"y_mm":2,"z_mm":3,"fx_N":4,"fy_N":5,"fz_N":6}').time == 9.0
    assert read("9,6,5,4,3,2,1", "t_s,fz_N,fy_N,fx_N,z_mm,y_mm,x_mm").tip == (1.0, 2.0, 3.0)
    assert read("\n") is None


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("1,2,3,4,5", "5 columns"),
        ("1,2,3,4,5,6,7,8", "8 columns"),
        ("1,2,3,4,5,x y", "'x y' is not a number"),
        ("1,,3,4,5,6", "'' is not a number"),
        ("1,2,3,4,5,nan", "not finite"),
        ("1,2,3,4,5,inf", "not finite"),
        ("x_mm,y_mm", "z_mm is missing"),
        ("x_mm,y_mm,z_mm,fx_N,fy_N,fz_N,colour", "'colour' is none of"),
        ("x_mm,y_mm,z_mm,fx_N,fy_N,fz_N,x_mm", "twice"),
        ('{"x_mm":1}', "y_mm is missing"),
        ('{"x_mm":true,"y_mm":2,"z_mm":3,"fx_N":4,"fy_N":5,"fz_N":6}', "x_mm is not a number"),
        ('{"x_mm":1e999,"y_mm":2,"z_mm":3,"fx_N":4,"fy_N":5,"fz_N":6}', "not finite"),
        ('{"x_mm":1,', "no JSON"),
    ],
)
def test_what_cannot_be_read_is_refused(line, message):
    with pytest.raises(ConfigError, match=message) as error:
        read(line)
    assert error.value.rule == "CC270"


def test_rows_below_a_bad_header_are_refused():
    reader = Reader()
    with pytest.raises(ConfigError):
        reader.read(b"x_mm,y_mm,z_mm,fx_N,fy_N,force")
    with pytest.raises(ConfigError, match="header"):
        reader.read(b"1,2,3,4,5,6")


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
    done = camcomp("stream", "--config", MACHINE, stdin="\n".join(lines).encode())
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
    assert b"2 set-points" in done.stderr and b"2 errors" in done.stderr


def test_json_answers(job):
    given = '{"t_s": 1.5, "x_mm": 1, "y_mm": 2, "z_mm": 0, "fx_N": 0, "fy_N": 0, "fz_N": 0}\n'
    done = camcomp("stream", "--json", "--config", MACHINE, stdin=given.encode())
    assert done.returncode == 0, done.stderr.decode()
    (record,) = [json.loads(line) for line in done.stdout.decode().splitlines()]
    assert record["t_s"] == 1.5 and record["x_mm"] == 1.0 and "error" not in record
    assert abs(record["xc_mm"] - 1.0) > 1e-3  # the chain errors alone move the tip
