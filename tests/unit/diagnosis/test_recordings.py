"""Tables of others as logs: what is read, what is left out and said, what is refused and where."""

import io

import numpy as np
import pytest
from scipy.io import savemat

from camcomp.model.config.load import load_experiment
from camcomp.terminal.cli import run
from tests.importing import imported

JOINTS = ["shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3"]
HEAD = ";".join(["Timestamp", *(f"{j}_joint" for j in JOINTS), "measurement_x", "measurement_y", "measurement_z"])
ROW = "20200714163904;-1,5;0,25;1;2;3;0,0;2361,9831;-1368,5474;119,39713"
LOG = ["t_s", *(f"act_{j}_rad" for j in JOINTS), "x_mm", "y_mm", "z_mm"]


@pytest.fixture
def read(tmp_path, capsys):
    """Imports a text, or several under their names, with options."""

    def read(text, *more, name="poses.csv", **config):
        texts = text if isinstance(text, dict) else {name: text}
        for each, content in texts.items():
            (tmp_path / each).parent.mkdir(exist_ok=True)
            (tmp_path / each).write_bytes(content if isinstance(content, bytes) else content.encode())
        files = "+".join(str(tmp_path / each) for each in texts)
        return imported(capsys, tmp_path / "x", files, *more, **config)

    return read


def rows_of(count, start=0.0):
    return "\n".join(ROW.replace("163904", f"{163904 + k}").replace("-1,5", f"{start + k}") for k in range(count))


def test_semicolons_and_decimal_commas(read):
    got = read(f"{HEAD}\r\n{ROW}\r\n{ROW.replace('163904', '164004')}\r\n")
    log = got.logs["poses"]
    assert list(log) == LOG
    assert [log[name][0] for name in LOG] == [0, -1.5, 0.25, 1, 2, 3, 0, 2361.9831, -1368.5474, 119.39713]
    assert log["t_s"][1] == 60  # stamps become seconds
    assert "poses: 2 rows; complete\n" in got.told


def test_commas_points_and_empty_cells(read):
    text = (HEAD + "\n" + ROW.replace(",", ".")).replace(";", ",").replace("119.39713", "")
    got = read(text + "\n")
    assert np.isnan(got.logs["poses"]["z_mm"][0]) and got.logs["poses"]["y_mm"][0] == -1368.5474
    assert "empty cells: 1 in z_mm" in got.told


def test_times_that_say_nothing_become_row_numbers(read):
    got = read(f"{HEAD}\n{ROW}\n{ROW}\n{ROW}\n")
    assert list(got.logs["poses"]["t_s"]) == [0, 1, 2]
    assert "no usable times" in got.told


@pytest.mark.parametrize(
    ("head", "times", "due"),
    [
        ("time [ms]", (500, 750), 0.25),
        ("time_ms", (500, 750), 0.25),
        ("t_s", (5, 5.25), 0.25),
        ("timestamp", (1700000000250, 1700000000500), 0.25),  # ms since 1970
    ],
)
def test_times_in_their_units(read, head, times, due):
    text = f"{HEAD}\n{ROW}\n{ROW}\n".replace("Timestamp", head)
    for each in times:
        text = text.replace("20200714163904", str(each), 1)
    assert read(text).logs["poses"]["t_s"][1] == pytest.approx(due)


def test_columns_can_be_named_and_rows_thinned(read):
    text = f"{HEAD.replace('elbow_joint', 'j3')}\n{rows_of(50)}"
    got = read(text)
    assert got.code == 2 and got.yaml is None and not got.logs
    assert "poses.csv:1:1: error[CC421]: no column for act_elbow_rad" in got.told
    assert "--column act_elbow_rad=THEIRS" in got.told and "j3" in got.told
    got = read(text, "--column", "act_elbow_rad=J3", "--rows", "20", "--radians")
    assert len(got.logs["poses"]["t_s"]) == 20
    assert "20 of 50 rows (--rows), 30 dropped" in got.told


@pytest.mark.parametrize(
    ("column", "hint"),
    [
        ("act_elbow_rad=elbow_jiont", "did you mean elbow_joint?"),
        ("act_elbo_rad=elbow_joint", "did you mean act_elbow_rad?"),
        ("act_elbow_rad", "act_elbow_rad is not LOG=THEIRS"),
    ],
)
def test_a_name_that_is_not_there_is_an_error(read, column, hint):
    got = read(f"{HEAD}\n{ROW}\n", "--column", column)
    assert got.code == 2 and "CC421" in got.told and hint in got.told and got.yaml is None


def test_a_word_in_a_cell_is_refused_on_its_line_and_in_a_column_of_no_use_it_is_not(read):
    text = f"{HEAD};remark\n{ROW};fine\n{ROW.replace('0,25', 'n.a.')};bad\n"
    got = read(text)
    assert got.code == 2
    assert "poses.csv:3:21: error[CC422]: 'n.a.' in column shoulder_lift_joint is not a number" in got.told
    got = read(text.replace("n.a.", "0,5"))
    assert got.code == 0 and "1 column dropped: remark" in got.told


def test_blank_separated_without_header(read):
    poses = np.column_stack([np.linspace(0, 1, 60).reshape(10, 6), np.arange(30).reshape(10, 3)])
    text = "# six joints, then the tracker\n" + "\n".join("   ".join(f"{v:.4f}" for v in row) for row in poses) + "\n"
    got = read(text, "--columns", " ".join(LOG[1:]), name="poses.txt")
    assert [list(got.logs["poses"][name]) for name in LOG[1:]] == [pytest.approx(each, abs=1e-4) for each in poses.T]
    assert "1 lines of remarks dropped" in got.told and "t_s is the number of the row" in got.told
    by_number = [word for k, name in enumerate(LOG[1:]) for word in ("--column", f"{name}={k + 1}")]
    assert read(text, *by_number, name="more.txt").code == 5  # the folder holds an experiment
    few = read(text, "--columns", "x_mm y_mm", name="poses.txt")
    assert few.code == 2 and "poses.txt:2:1: error[CC421]: 2 names for 9 columns" in few.told
    word = read(text.replace("0.0169", "n/a"), "--columns", " ".join(LOG[1:]), name="poses.txt")
    assert word.code == 2 and "poses.txt:2:10: error[CC422]" in word.told


def test_columns_of_a_table_without_header_by_number(read):
    named = ("t_s=1", "cmd_x_mm=2", "cmd_y_mm=3", "cmd_z_mm=4", "act_x_mm=2")
    words = [word for each in named for word in ("--column", each)]
    got = read("0,1,2,3\n1,2,3,4\n2,3,4,5\n", *words, config="cartesian")
    assert list(got.logs["poses"]["cmd_z_mm"]) == [3, 4, 5] and list(got.logs["poses"]["act_x_mm"]) == [1, 2, 3]


def test_degrees_by_size_by_unit_and_as_told(read, tmp_path):
    wide = ROW.replace("-1,5", "-150")
    got = read(f"{HEAD}\n{wide}\n")
    assert got.logs["poses"]["act_shoulder_pan_rad"][0] == pytest.approx(np.radians(-150))
    assert got.logs["poses"]["act_elbow_rad"][0] == pytest.approx(np.radians(1))
    assert "joint angles are read as degrees: they go up to 150" in got.told
    for name, text, words, due in (
        ("a", f"{HEAD}\n{wide}\n", ["--radians"], -150),
        ("b", f"{HEAD}\n{ROW}\n", ["--degrees"], np.radians(-1.5)),
        ("c", f"{HEAD}\n{ROW}\n".replace("pan_joint", "pan_joint [deg]"), [], np.radians(-1.5)),
        ("d", f"{HEAD}\n{wide}\n".replace("pan_joint", "pan_joint_rad"), [], -150),
        ("e", f"{HEAD}\n{wide}\n".replace("shoulder_pan_joint", "act_shoulder_pan_rad"), [], -150),
    ):
        (tmp_path / "x/experiment.yaml").unlink()
        got = read(text, *words, name=f"{name}.csv")
        assert got.logs[name]["act_shoulder_pan_rad"][0] == pytest.approx(due), name


def test_degrees_in_columns_that_are_named_as_those_of_the_log(read):
    text = "\n".join(f"{k} 0 0 0 0 90.5 1 2 3.0" for k in (10, 20, 15))
    got = read(text, "--columns", " ".join(LOG[1:]))
    assert got.logs["poses"]["act_wrist_3_rad"][0] == pytest.approx(np.radians(90.5))


def test_lengths_in_the_unit_that_is_stated(read):
    head = HEAD.replace("measurement_x", "measurement_x (m)").replace("measurement_y", "measurement_y_um")
    log = read(f"{head}\n{ROW}\n").logs["poses"]
    assert (log["x_mm"][0], log["y_mm"][0], log["z_mm"][0]) == (2361983.1, -1.3685474, 119.39713)


def test_orientation_and_other_columns_are_said_to_be_dropped(read):
    got = read(f"{HEAD};qx;qy;qz;qw;humidity;remark\n{ROW};0;0;0;1;40;fine\n")
    assert "orientation dropped, a log holds the place of the tip only: qx, qy, qz, qw" in got.told
    assert "2 columns dropped: humidity, remark" in got.told


def test_rows_without_time_or_values_are_dropped_and_counted(read):
    nothing = "20200714163909" + ";" * 9
    got = read("\n".join([HEAD, rows_of(3), ROW.replace("20200714163904", ""), nothing]))
    assert len(got.logs["poses"]["t_s"]) == 3
    assert "1 rows without values dropped" in got.told and "1 rows without time dropped" in got.told


DRIVEN = "t,x_cmd,y_cmd,z_cmd,act_x,act_y,act_z\n0,0,0,0,0,0,0\n1,1,0,0,1,0,0\n1,1,0,0,1,0,0\n"


def test_a_run_that_was_driven_needs_times_that_run_forward(read):
    got = read(f"{DRIVEN}2,2,0,0,2,0,0\n", config="cartesian")
    assert list(got.logs["poses"]["t_s"]) == [0, 1, 2] and list(got.logs["poses"]["cmd_x_mm"]) == [0, 1, 2]
    assert "1 rows of a time that was there before dropped" in got.told
    back = read(f"{DRIVEN}0.5,2,0,0,2,0,0\n", config="cartesian")
    assert back.code == 2 and "poses.csv:5:1: error[CC405]: time goes back by 0.5 s" in back.told


def test_a_run_of_one_axis_needs_times_that_run_forward_too(read):
    got = read("t,act_x,x_cmd\n0,0,0\n1,1,1\n0.5,2,2\n", config="cartesian")
    assert got.code == 2 and "poses.csv:4:1: error[CC405]: time goes back by 0.5 s" in got.told


def test_what_could_be_several_columns_is_not_guessed(read):
    text = "t,x,y,z,x_cmd,y_cmd,z_cmd\n0,0,0,0,0,0,0\n1,1,0,0,1,0,0\n2,2,0,0,2,0,0\n"
    got = read(text, config="cartesian")  # the tip, or the actuators of these names
    assert got.code == 2 and "CC421" in got.told and "it could be x" in got.told
    got = read(text, *(w for a in "xyz" for w in ("--column", f"{a}_mm={a}")), config="cartesian")
    assert list(got.logs["poses"]) == ["t_s", "cmd_x_mm", "cmd_y_mm", "cmd_z_mm", "x_mm", "y_mm", "z_mm"]


SAMPLES = "".join(f"{k} {0.1 * k:.6f} 0.000000 1.000000 {0.1 * k - 0.05:.6f} 7 \n" for k in (5, 6, 7, 9, 10, 11))
PINS = "cmd_x_mm cmd_y_mm cmd_z_mm act_x_mm line"


def test_halsampler_counts_samples(read):
    got = read(
        SAMPLES.replace("9 0.9", "overrun\n9 0.9") + "12 1.2", "--columns", PINS, name="r.sam", config="cartesian"
    )
    log = got.logs["r"]
    assert list(log["t_s"]) == pytest.approx([0, 0.001, 0.002, 0.004, 0.005, 0.006])
    assert list(log["cmd_x_mm"]) == pytest.approx([0.5, 0.6, 0.7, 0.9, 1.0, 1.1]) and set(log["line"]) == {7}
    for said in ("samples of 1 ms", "1 samples were lost", "could not keep up 1 times", "the last row ends early"):
        assert said in got.told


@pytest.mark.parametrize("first", ["", "sample ", "t "])
def test_halsampler_s_period_and_its_first_column(read, first):
    got = read(SAMPLES, "--columns", first + PINS, "--period-s", "0.002", name="r.sam", config="cartesian")
    assert got.logs["r"]["t_s"][-1] == pytest.approx(0.012) and "samples of 2 ms" in got.told


def test_bad_halsampler_files_are_refused_where_they_are_bad(read):
    got = read(SAMPLES.replace("0.7", "o.7"), "--columns", PINS, name="r.sam", config="cartesian")
    assert got.code == 2 and "r.sam:3:3: error[CC422]" in got.told
    assert read("", name="r.sam").code == 2
    got = read(SAMPLES.replace("\n", " 8 9 \n", 1), "--columns", PINS + " - -", name="r.sam", config="cartesian")
    assert got.code == 0


def test_two_files_row_by_row(read):
    joints = ";".join(HEAD.split(";")[:7])
    tips = HEAD.split(";")[7:]
    first = "\n".join(";".join(row.split(";")[:7]) for row in [joints, *rows_of(12).split("\n")])
    second = "\n".join([",".join(tips), *(f"{k},{2 * k},{3 * k}" for k in range(12))])
    got = read({"joints.csv": first, "tracker.csv": second}, "--degrees")
    log = got.logs["joints"]
    assert list(log["z_mm"]) == list(range(0, 36, 3)) and list(log["act_elbow_rad"]) == pytest.approx(
        [np.radians(1)] * 12
    )
    assert "joined row by row:" in got.told and "tracker.csv" in got.told


def test_two_files_of_which_one_or_both_have_no_header(read, tmp_path):
    joints, tips = "\n".join(f"{k} 0 0 0 0 0" for k in (0.1, 0.3, 0.2)), "x;y;z\n1;2;3\n4;5;6\n7;8;9\n"
    names = " ".join(LOG[1:7])
    got = read({"j.txt": joints, "t.csv": tips}, "--columns", names)
    assert list(got.logs["j"]["act_shoulder_pan_rad"]) == [0.1, 0.3, 0.2] and list(got.logs["j"]["z_mm"]) == [3, 6, 9]
    (tmp_path / "x/experiment.yaml").unlink()
    bare = tips.split("\n", 1)[1]
    got = read({"k.txt": joints, "t.csv": bare}, "--columns", names, "--columns", "x_mm - z_mm")
    assert got.code == 2 and "no column for y_mm" in got.told
    got = read({"k.txt": joints, "t.csv": bare}, "--columns", names, "--columns", "x_mm y_mm z_mm")
    assert list(got.logs["k"]["z_mm"]) == [3, 6, 9]
    got = read(tips, "--columns", names, name="t.csv")
    assert got.code == 2 and "t.csv:1:1: error[CC421]: the recording has names of its own" in got.told


def test_two_files_that_cannot_be_joined(read):
    head, tips = ";".join(HEAD.split(";")[:7]), "measurement_x,measurement_y,measurement_z\n1,2,3\n"
    rows = "\n".join(";".join(row.split(";")[:7]) for row in rows_of(3).split("\n"))
    got = read({"joints.csv": f"{head}\n{rows}\n", "tracker.csv": tips})
    assert got.code == 2 and "tracker.csv:1:1: error[CC453]" in got.told and got.yaml is None
    late = f"time,{tips.splitlines()[0]}\n" + "\n".join(f"{900 + k},1,2,3" for k in range(5))
    early = head.replace("Timestamp", "time").replace(";", ",") + "\n" + "\n".join(f"{k},1,1,1,1,1,1" for k in range(9))
    got = read({"joints.csv": early, "tracker.csv": late})
    assert got.code == 2 and "too little in common" in got.told
    between = f"time,{tips.splitlines()[0]}\n3.4,1,2,3\n"
    got = read({"joints.csv": early, "tracker.csv": between})
    assert got.code == 2 and "no rows of the parts belong to the same time" in got.told
    got = read({"joints.csv": early, "tracker.csv": tips}, "--join", "rows")
    assert got.code == 2 and "9 and 1 rows cannot be joined row by row" in got.told


def test_two_files_on_time(read):
    time = 0.001 * np.arange(400)
    drive = "t,x_cmd,y_cmd,z_cmd,line\n" + "\n".join(f"{t:.3f},{10 * t:.5f},0,0,{int(10 * t)}" for t in time)
    laser = "t,measurement_x,measurement_y,measurement_z\n" + "\n".join(
        f"{t:.4f},{10 * t + 0.01:.5f},0,0" for t in 0.0095 + 0.01 * np.arange(60)
    )
    got = read({"drive.csv": drive, "laser.csv": laser}, config="cartesian")
    log = got.logs["drive"]
    assert len(log["t_s"]) == 39 and np.diff(log["t_s"]) == pytest.approx(0.01)
    assert log["x_mm"] - log["cmd_x_mm"] == pytest.approx(0.01, abs=1e-5)
    assert log["line"][0] == 0 and log["line"][-1] == 3 and set(log["line"]) == {0, 1, 2, 3}
    assert "joined on time, on the rows of" in got.told and "21 rows outside the common time dropped" in got.told


def test_poses_of_two_files_are_matched_and_not_mixed(read):
    joints = ",".join(["time", *JOINTS]) + "\n" + "\n".join(f"{5 * k},{k / 10}" + ",0" * 5 for k in range(12))
    tracker = "time,measurement_x,measurement_y,measurement_z\n" + "\n".join(
        f"{5 * k + 1.2},{100 * k},0,0" for k in range(12) if k != 4
    )
    got = read({"joints.csv": joints, "tracker.csv": tracker})
    log = got.logs["joints"]
    assert log["x_mm"] == pytest.approx(1000 * log["act_shoulder_pan_rad"])
    assert "joined nearest in time" in got.told


def test_an_axis_recording_that_lacks_something_is_refused(read):
    buffer = io.BytesIO()
    savemat(buffer, {"t": np.arange(5.0), "qg": np.arange(5.0)})
    got = read(buffer.getvalue(), name="axis.mat", config="cartesian")
    assert got.code == 2 and "CC421" in got.told and "there are: t, qg" in got.told
    savemat(buffer := io.BytesIO(), {"t": np.arange(5.0), "qg": np.arange(5.0), "qm": np.arange(5.0)})
    assert "CC423" in read(buffer.getvalue(), "--actuator", "v", name="axis.mat", config="cartesian").told
    assert "not a MATLAB file" in read(b"nonsense", name="axis.mat", config="cartesian").told


def test_an_axis_recording_s_rows_and_variables_that_are_dropped_are_said(read):
    buffer = io.BytesIO()
    t = np.arange(20.0)
    savemat(buffer, {"t": t, "qg": t, "qm": t, "noise": t})
    got = read(buffer.getvalue(), "--rows", "12", name="axis.mat", config="cartesian")
    log = got.logs["axis"]
    assert len(log["t_s"]) == 12 and list(log["act_x_mm"]) == list(1000 * log["t_s"]) and log["t_s"][-1] == 19.0
    assert "1 column dropped: noise" in got.told and "8 dropped" in got.told


def test_variables_of_any_matlab_file_are_columns_by_the_names_that_are_told(read):
    savemat(
        buffer := io.BytesIO(),
        {"clock": np.arange(5.0), "ask": np.arange(5.0), "got": 2.0 * np.arange(5.0), "one": 1.0},
    )
    told = [word for each in ("t_s=clock", "cmd_y_mm=ask", "act_y_mm=got") for word in ("--column", each)]
    got = read(buffer.getvalue(), *told, name="axis.mat", config="cartesian")
    assert got.code == 0 and list(got.logs["axis"]["act_y_mm"]) == [0.0, 2.0, 4.0, 6.0, 8.0]
    assert "variables dropped: one" in got.told


def test_runs_are_called_by_their_files_and_each_name_is_there_once(tmp_path, capsys):
    files = []
    for folder, name in (("a", "poses"), ("b", "poses"), ("b", "POSES"), ("a", "12"), ("a", "yes"), ("a", "it's: #1")):
        (tmp_path / folder).mkdir(exist_ok=True)
        files.append(tmp_path / folder / f"{name}.csv")
        files[-1].write_text(f"{HEAD}\n{ROW}\n")
    got = imported(capsys, tmp_path / "x", *files, "--holdout", "poses-2", "--holdout", "12")
    assert got.code == 0, got.told
    experiment = load_experiment(tmp_path / "x/experiment.yaml")
    names = ["poses", "poses-2", "POSES-3", "12", "yes", "it's: #1"]
    assert [run.name for run in experiment.runs] == names == [run.clamping for run in experiment.runs]
    assert all((tmp_path / "x" / f"{name}.csv").exists() for name in names)
    assert experiment.holdout == ["poses-2", "12"] and all(run.program is None for run in experiment.runs)
    assert f"poses-2 ({files[1]}): 1 rows" in got.told


def test_nothing_is_written_over_and_a_wrong_word_leaves_nothing(tmp_path, capsys):
    (tmp_path / "poses.csv").write_text(f"{HEAD}\n{ROW}\n")
    got = imported(capsys, tmp_path / "x", tmp_path / "poses.csv", "--holdout", "pose")
    assert got.code == 2 and "CC424" in got.told and not (tmp_path / "x").exists()
    (tmp_path / "x").mkdir()
    (tmp_path / "x/experiment.yaml").symlink_to(tmp_path / "elsewhere")
    got = imported(capsys, tmp_path / "x", tmp_path / "poses.csv")
    assert got.code == 5 and "is there already" in got.told and not (tmp_path / "x/poses.csv").exists()
    got = imported(capsys, tmp_path / "poses.csv", tmp_path / "poses.csv")
    assert got.code == 5 and "CC501" in got.told


def test_the_experiment_is_what_diagnose_reads(tmp_path, capsys):
    (tmp_path / "poses.csv").write_text(f"{HEAD}\n{ROW}\n")
    assert imported(capsys, tmp_path / "x", tmp_path / "poses.csv").code == 0
    assert run(["diagnose", str(tmp_path / "x/experiment.yaml")]) == 2
    told = capsys.readouterr().err
    assert "CC420" in told and "has 1 poses" in told


def test_programs_and_clampings_as_told(tmp_path, capsys):
    (tmp_path / "run.csv").write_text(DRIVEN.replace("1,1,0,0,1,0,0\n", "", 1))
    (tmp_path / "part.nc").write_text("G1 X1 F60\n")
    got = imported(
        capsys, tmp_path / "x", tmp_path / "run.csv", "--program", f"run={tmp_path}/part.nc", "--cutting",
        "--one-clamping", config="cartesian",
    )  # fmt: skip
    part = load_experiment(tmp_path / "x/experiment.yaml").runs[0]
    assert part.cutting and part.clamping is None and (tmp_path / "part.nc").samefile(part.program), got.told
    for word, rule in ((f"other={tmp_path}/part.nc", "CC424"), (f"run={tmp_path}/pat.nc", "CC500")):
        got = imported(capsys, tmp_path / "y", tmp_path / "run.csv", "--program", word, config="cartesian")
        assert rule in got.told and got.yaml is None


ARM = "Time;A1 command [deg];A1 actual [deg];A1 torque [Nm];act_A2_deg;cmd_A2_rad;act_A2_Nm;act_A3_Nmm;act_A3_rad;se_A1_deg;se_A2_deg\n"


def test_names_and_units_that_joints_have_elsewhere(read):
    """Set-points, encoders, torques and second encoders in degrees and N m; a clock with a date; a second encoder that is not there."""
    rows = "".join(
        f"11.10.2022 15:06:{48.043 + 0.5 * k:06.3f};90;{45 + k};2.5;{90 + k};0.25;1;7;0.5;{45.1 + k};0\n"
        for k in range(4)
    )
    got = read(ARM + rows, config="kuka-kr210")
    log = got.logs["poses"]
    np.testing.assert_allclose(log["t_s"], [0.0, 0.5, 1.0, 1.5], atol=1e-6)
    first = {name: values[0] for name, values in log.items()}
    expected = {
        "t_s": 0.0, "cmd_A1_rad": np.pi / 2, "cmd_A2_rad": 0.25, "act_A1_rad": np.pi / 4, "act_A2_rad": np.pi / 2,
        "act_A3_rad": 0.5, "act_A1_Nmm": 2500.0, "act_A2_Nmm": 1000.0, "act_A3_Nmm": 7.0, "load_A1_rad": np.radians(45.1),
    }  # fmt: skip
    assert first == pytest.approx(expected, abs=1e-8)
    assert "second encoders that never move dropped: load_A2_rad" in got.told


def test_names_that_controls_of_machine_tools_give_to_axes(read):
    """Words written as one, a number behind the letter of an axis; speeds and currents are none of a log's columns."""
    heads = [
        f"{a}1_{word}"
        for a in "XYZ"
        for word in ("ActualPosition", "ActualVelocity", "CommandPosition", "CurrentFeedback")
    ]
    rows = [",".join(str(10 * k + i) for i in range(len(heads))) for k in range(4)]
    got = read("\n".join([",".join(heads), *rows]), "--period-s", "0.1", config="cartesian")
    first = {name: values[1] for name, values in got.logs["poses"].items()}
    places = {"act_x_mm": 10, "cmd_x_mm": 12, "act_y_mm": 14, "cmd_y_mm": 16, "act_z_mm": 18, "cmd_z_mm": 20}
    assert first == pytest.approx({"t_s": 0.1, **places})
    assert "6 columns dropped" in got.told


SLIDE = "datetime,x_soll [m],x_ist [m],note\n2025-03-04 10:11:12.5,0,0,a\n2025-03-04 10:11:13.5,0.001,0.0005,b\n"
BELOW = "t;x_cmd;x_act;speed\n[ms];mm;in;mm/s\n0;0;0;1,5\n1000;1;0,0196850394;1,5\n"
SINCE = "time,x_cmd,x_act\n1700000000000000000,0,0\n1700000001000000000,1,0.5\n"


@pytest.mark.parametrize(
    "text", [SLIDE, BELOW, SINCE, SINCE.encode("utf-16")], ids=["dates", "units below", "ns", "UTF-16"]
)
def test_what_loggers_write_of_a_slide(read, text):
    """Dates under any of their names, units in a row below the names, ns since 1970, text of Windows; words for set-points."""
    log = read(text, config="cartesian").logs["poses"]
    assert list(log) == ["t_s", "cmd_x_mm", "act_x_mm"]
    assert [values[1] for values in log.values()] == pytest.approx([1.0, 1.0, 0.5])


def test_words_in_all_cells_of_the_first_row_are_no_units_by_themselves(read):
    got = read("t,x_cmd,x_act\nfirst,low,high\n0,0,0\n1,1,0.5\n", config="cartesian")
    assert got.code == 2 and "poses.csv:2:7: error[CC422]: 'low' in column x_cmd is not a number" in got.told


CURRENT = "x_cmd,y_cmd,z_cmd,act_x,act_y,act_z,X1_Current\n0,0,0,0,0,0,1.5\n1,1,0,0,1,0,2\n2,2,0,0,2,0,-3\n"


def test_a_column_takes_a_factor_to_the_unit_of_the_log(read):
    got = read(CURRENT, "--column", "act_x_N=x1_current*-120", "--period-s", "0.1", config="cartesian")
    assert list(got.logs["poses"]["act_x_N"]) == [-180.0, -240.0, 360.0] and "dropped" not in got.told


@pytest.mark.parametrize("factor", ["12O", "nan", "0", ""])
def test_a_factor_has_to_be_a_number(read, factor):
    got = read(CURRENT, "--column", f"act_x_N=X1_Current*{factor}", config="cartesian")
    assert got.code == 2 and f"CC421]: there is no column X1_Current*{factor}" in got.told
    assert "did you mean X1_Current?" in got.told


def test_a_run_that_was_driven_without_times_asks_for_the_step_between_its_rows(read):
    got = read("x_cmd,y_cmd,z_cmd,act_x,act_y,act_z\n0,0,0,0,0,0\n1,1,0,0,1,0\n2,2,0,0,2,0\n", config="cartesian")
    assert got.code == 0 and "speeds and lags are per row, unless --period-s says" in got.told


@pytest.mark.parametrize(
    ("asked", "met", "first"),
    [
        ("target_q_{}", "actual_q_{}", 0),  # RTDE of Universal Robots
        ("q_d_{}", "q_{}", 1),
        ("cmd/position[{}] [deg]", "state/position[{}] [deg]", 0),
        ("Joint{}TargetPosition", "Joint{}ActualPosition", 1),
        ("DES_POS|{}", "ENC1_POS|{}", 1),  # Sinumerik
    ],
)
def test_columns_that_count_all_joints_are_joints_in_order(read, asked, met, first):
    heads = [text.format(k + first) for text in (asked, met) for k in range(6)]
    rows = [",".join(str(each) for each in (t, *range(t, t + 12))) for t in range(3)]
    got = read("\n".join([",".join(["time", *heads]), *rows]), "--radians")
    scale = np.pi / 180.0 if "deg" in asked else 1.0
    for k, joint in enumerate(JOINTS):
        assert got.logs["poses"][f"cmd_{joint}_rad"][0] == pytest.approx(scale * k)
        assert got.logs["poses"][f"act_{joint}_rad"][0] == pytest.approx(scale * (k + 6))
    assert "are taken as act_shoulder_pan_rad to act_wrist_3_rad, in this order" in got.told


def test_numbers_that_may_not_be_the_joints_are_not_guessed(read):
    head = [
        "time",
        *(f"q_{k}" for k in range(7)),
        *(f"actual_qd_{k}" for k in range(6)),
        *(f"tau_{k}" for k in range(6)),
    ]
    got = read(",".join(head) + "\n" + ",".join("0" for _ in head) + "\n")
    assert got.code == 2 and "no column for act_shoulder_pan_rad" in got.told
    head[1:8] = [f"q_{k}" for k in range(6)]
    twice = read(",".join([*head, *(f"pos_{k}" for k in range(6))]) + "\n" + ",".join("0" for _ in range(25)) + "\n")
    assert twice.code == 2 and "it could be q_0, pos_0" in twice.told


@pytest.mark.parametrize(
    ("unit", "due"),
    [
        ("", "tau_0 to tau_5 left out, they state no unit: tau_0_Nm would be one"),
        ("_Nm", "tau_0_Nm to tau_5_Nm are taken as act_shoulder_pan_Nmm to act_wrist_3_Nmm"),
    ],
)
def test_torques_that_are_counted_need_their_unit(read, unit, due):
    head = [*(f"q_{k}" for k in range(6)), *(f"tau_{k}{unit}" for k in range(6)), "x", "y", "z"]
    assert due in read(",".join(head) + "\n" + ",".join("1" for _ in head) + "\n").told
