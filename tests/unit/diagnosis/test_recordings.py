"""Recordings of others: what is read, what is refused and where."""

import numpy as np
import pytest

from camcomp.diagnosis.experiment.recordings import read_axis, read_poses
from camcomp.ground.errors import ConfigError
from camcomp.model.config.load import load_config
from tests.commandline import camcomp

JOINTS = ["shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3"]
HEAD = ";".join(["Timestamp", *(f"{j}_joint" for j in JOINTS), "measurement_x", "measurement_y", "measurement_z"])
ROW = "20200714163904;-1,5;0,25;1;2;3;0,0;2361,9831;-1368,5474;119,39713"


@pytest.fixture(scope="module")
def actuators():
    return load_config(["config/ur10.yaml"]).robot.actuators


def read(text, actuators, **more):
    return read_poses(text.encode(), "poses.csv", actuators, **more)


def test_semicolons_and_decimal_commas(actuators):
    got = read(f"{HEAD}\r\n{ROW}\r\n{ROW.replace('163904', '164004')}\r\n", actuators)
    lines = got.log.decode().splitlines()
    assert lines[0].split(",")[:2] == ["t_s", "act_shoulder_pan_rad"]
    assert lines[0].endswith("x_mm,y_mm,z_mm")
    assert lines[1] == "0,-1.5,0.25,1,2,3,0,2361.9831,-1368.5474,119.39713"
    assert lines[2].startswith("60,")  # stamps become seconds
    assert (got.name, got.rows, got.notes) == ("poses", 2, ())


def test_commas_points_and_empty_cells(actuators):
    text = (HEAD + "\n" + ROW.replace(",", ".")).replace(";", ",").replace("119.39713", "")
    assert read(text + "\n", actuators).log.decode().splitlines()[1].endswith("-1368.5474,")


def test_times_that_say_nothing_become_row_numbers(actuators):
    got = read(f"{HEAD}\n{ROW}\n{ROW}\n{ROW}\n", actuators)
    assert [line.split(",")[0] for line in got.log.decode().splitlines()[1:]] == ["0", "1", "2"]
    assert "no usable times" in got.notes[0]


def test_columns_can_be_named_and_rows_thinned(actuators):
    text = f"{HEAD.replace('elbow_joint', 'j3')}\n" + "\n".join([ROW] * 100)
    with pytest.raises(ConfigError, match="no column for act_elbow_rad") as caught:
        read(text, actuators)
    assert caught.value.rule == "CC421" and "--column act_elbow_rad=THEIRS" in caught.value.hint
    got = read(text, actuators, columns={"act_elbow_rad": "j3"}, rows=20)
    assert got.rows == 20


def test_a_word_in_a_cell_is_refused_on_its_line(actuators):
    with pytest.raises(ConfigError, match="'n.a.' in column shoulder_lift_joint is not a number") as caught:
        read(f"{HEAD}\n{ROW}\n{ROW.replace('0,25', 'n.a.')}\n", actuators)
    assert (caught.value.rule, caught.value.at.line) == ("CC422", 3)


def test_an_axis_recording_that_lacks_something_is_refused(actuators):
    import io

    from scipy.io import savemat

    buffer = io.BytesIO()
    savemat(buffer, {"t": np.arange(5.0), "qg": np.arange(5.0)})
    with pytest.raises(ConfigError, match="no variable qm") as caught:
        read_axis(buffer.getvalue(), "axis.mat", actuators)
    assert caught.value.rule == "CC423"
    with pytest.raises(ConfigError, match="not a MATLAB file"):
        read_axis(b"nonsense", "axis.mat", actuators)


def test_names_of_runs_and_files_that_are_there(tmp_path):
    (tmp_path / "a").mkdir()
    for folder in (tmp_path, tmp_path / "a"):
        (folder / "poses.csv").write_text(f"{HEAD}\n{ROW}\n")
    twice = camcomp(
        "import", tmp_path / "poses.csv", tmp_path / "a/poses.csv", "--config", "config/ur10.yaml", "-o", tmp_path / "x"
    )
    assert twice.returncode == 2 and b"CC424" in twice.stderr
    once = ("import", tmp_path / "poses.csv", "--config", "config/ur10.yaml", "-o", tmp_path / "x")
    assert camcomp(*once).returncode == 0
    again = camcomp(*once)
    assert again.returncode == 5 and b"is there already" in again.stderr
    few = camcomp("diagnose", tmp_path / "x/experiment.yaml")
    assert few.returncode == 2 and b"CC420" in few.stderr and b"has 1 poses" in few.stderr
