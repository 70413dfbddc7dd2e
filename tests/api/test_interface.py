"""`import camcomp`: what it gives is what the commands print, as arrays."""

import json
import sys

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

import camcomp
from camcomp.ground.errors import CheckFailed, ConfigError
from camcomp.ground.files import shipped
from camcomp.terminal.cli import run
from tests.commandline import rms_um, table

MACHINE = str(shipped("config/orthoglide-1deg.yaml"))
GROOVE = str(shipped("samples/groove-circle-2.nc"))
CLEAR = shipped("samples/diagnosis/clear/experiment.yaml")


@pytest.fixture(scope="module")
def machine():
    return camcomp.load_machine(MACHINE)


@pytest.fixture(scope="module")
def compensated(machine):
    return camcomp.compensate(GROOVE, machine)


@pytest.fixture(scope="module")
def diagnosed():
    return camcomp.diagnose(CLEAR)


def test_compensate_gives_what_the_command_writes(tmp_path, compensated):
    out, joints, paths, summary = (tmp_path / name for name in ("out.nc", "joints.csv", "paths.csv", "summary.json"))
    words = ["-o", out, "--joints", joints, "--paths", paths, "--summary", summary]
    assert run(["compensate", GROOVE, "--config", MACHINE, *map(str, words), "-q"]) == 0
    assert out.read_bytes() == compensated.data
    assert compensated.text.encode() == compensated.data
    assert json.loads(summary.read_text()) == compensated.summary.as_json()
    assert compensated.failed == []
    for file, made in ((joints, compensated.joints), (paths, compensated.paths)):
        asked = table(file)
        assert list(asked) == list(made)
        for name, values in asked.items():
            np.testing.assert_array_equal(values, made[name])
        assert made.to_csv() == file.read_bytes()
    np.testing.assert_allclose(
        compensated.joints.array("xc_mm", "yc_mm", "zc_mm"), compensated.outcome.written.end, atol=1e-6
    )


def test_what_was_compensated_is_refused(machine, compensated):
    with pytest.raises(CheckFailed) as caught:
        camcomp.compensate(compensated.data, machine)
    assert caught.value.rule == "CC603"


def test_verify_gives_what_the_command_writes(tmp_path, machine, compensated):
    corrected, out = tmp_path / "corrected.nc", tmp_path / "verified.json"
    corrected.write_bytes(compensated.data)
    assert run(["verify", str(corrected), "--against", GROOVE, "--config", MACHINE, "--json", str(out), "-q"]) == 0
    done = camcomp.verify(corrected, camcomp.read_program(GROOVE, machine), machine)
    assert done.figures(1.0).as_json() == json.loads(out.read_text())
    assert 0.0 < done.residual.max() < 1e-3


def test_simulate_gives_what_the_command_writes(tmp_path, machine):
    out = tmp_path / "log.csv"
    assert run(["simulate", GROOVE, "--config", MACHINE, "-o", str(out), "--step-s", "0.1"]) == 0
    log = camcomp.simulate(GROOVE, machine, 0.1)
    assert log.to_csv() == out.read_bytes()
    np.testing.assert_allclose(log.table["x_mm"], log.outcome.reading.tip[:, 0], atol=1e-6)
    assert log.table.rows == len(log.outcome.time)


def test_diagnose_gives_what_the_command_writes(tmp_path, capsys, diagnosed):
    result, residuals = tmp_path / "result.json", tmp_path / "residuals.csv"
    words = [str(CLEAR), "--json", str(result), "--residuals", str(residuals)]
    assert run(["diagnose", *words]) == 0
    assert capsys.readouterr().err.rstrip("\n").endswith("\n".join(diagnosed.answer))
    assert diagnosed.verdict == "identified"
    assert json.loads(result.read_text()) == diagnosed.result.as_json()
    assert residuals.read_bytes() == diagnosed.residuals.to_csv()
    assert residuals.read_text().startswith("run,t_s,line,gap_x_mm,gap_y_mm,gap_z_mm,gap_act_x_mm,")


def test_residuals_are_those_of_the_result(diagnosed):
    left = diagnosed.residuals
    assert rms_um(left, "gap") == pytest.approx(diagnosed.result.gap.rms_um, rel=1e-3)
    assert rms_um(left, "rest") == pytest.approx(diagnosed.result.shrinkage.after_rms_um, rel=0.05)
    assert sorted(set(left["run"])) == sorted(run.name for run in diagnosed.opened.runs)


def test_a_stream_is_made_of_a_machine(machine):
    point = camcomp.Stream(machine).correct((25.0, 0.0, 0.0), (215.0, -10.0, -25.0))
    assert point.commanded.shape == (3,) and np.isfinite(point.actuators).all()


@pytest.mark.parametrize("name", ["joints.csv", "joints.parquet"])
def test_files_by_their_suffix(compensated, name):
    data = compensated.joints.to_file(name)
    assert data.startswith(b"PAR1" if name.endswith("parquet") else b"line,s_mm")


def test_tables_keep_what_they_are_given():
    made = camcomp.ResultTable(
        {"run": np.array(["a,b", "c"]), "q_rad": np.array([1e-9, np.nan]), "row": np.array([1, 2])}
    )
    assert made.to_csv() == b'run,q_rad,row\n"a,b",0.000000001,1\nc,,2\n'
    again = camcomp.ResultTable.of_csv(made.to_csv())
    assert list(again) == list(made) and again.rows == 2 and list(again["run"]) == ["a,b", "c"]
    np.testing.assert_array_equal(again["q_rad"], made["q_rad"])
    with pytest.raises(ValueError, match="different lengths"):
        camcomp.ResultTable({"a": np.zeros(2), "b": np.zeros(3)})


def test_without_pandas_an_error_says_what_to_install(monkeypatch, compensated):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(ConfigError, match="pandas") as caught:
        compensated.joints.to_pandas()
    assert "camcomp[pandas]" in caught.value.hint


def test_a_data_frame_has_the_columns(compensated):
    pandas = pytest.importorskip("pandas")
    frame = compensated.joints.to_pandas()
    assert isinstance(frame, pandas.DataFrame)
    assert list(frame.columns) == list(compensated.joints) and len(frame) == compensated.joints.rows


def test_residuals_of_axes_are_those_of_their_logs(tmp_path):
    """A following error of 5 ms: what is left of it is nothing."""
    t = np.arange(0.0, 4.0, 0.002)
    setpoint = 40.0 * np.sin(2.0 * t)
    encoder = setpoint - 0.005 * 80.0 * np.cos(2.0 * t) + 1e-4 * np.random.default_rng(3).standard_normal(len(t))
    rows = "\n".join(f"{a:.4f},0,{b:.6f},{c:.6f}" for a, b, c in zip(t, setpoint, encoder, strict=True))
    (tmp_path / "log.csv").write_text(f"t_s,line,cmd_x_mm,act_x_mm\n{rows}\n")
    text = f"config: [{shipped('config/cartesian.yaml')}]\nruns: [{{name: one, log: log.csv, cutting: false}}]\n"
    (tmp_path / "experiment.yaml").write_text(text)
    done = camcomp.diagnose(tmp_path / "experiment.yaml")
    left = done.residuals
    assert list(left) == ["run", "t_s", "gap_act_x_mm", "rest_act_x_mm"]
    np.testing.assert_allclose(left["gap_act_x_mm"], encoder - setpoint - np.mean(encoder - setpoint), atol=2e-6)
    assert 1e3 * np.sqrt(np.mean(left["gap_act_x_mm"] ** 2)) == pytest.approx(done.result.gap.rms_um, rel=1e-3)
    known = np.isfinite(left["rest_act_x_mm"])
    assert known[20:].all()  # what the axis did before its log began still shows in the first rows
    assert np.sqrt(np.mean(left["rest_act_x_mm"][known] ** 2)) < 2e-4


def test_diagnose_works_with_one_thread_of_linear_algebra(monkeypatch):
    """In a Python that has numpy already, which has taken as many threads as there are cores."""
    seen: list[int] = []

    def opened(experiment):
        seen.extend(each["num_threads"] for each in threadpool_info() if each["user_api"] == "blas")
        raise ConfigError("CC201", "seen")

    monkeypatch.delenv("OPENBLAS_NUM_THREADS", raising=False)
    monkeypatch.setattr("camcomp.diagnosis.experiment.open_experiment.open_experiment", opened)
    with threadpool_limits(limits=2, user_api="blas"), pytest.raises(ConfigError):
        camcomp.diagnose(CLEAR)
    assert seen and set(seen) == {1}
