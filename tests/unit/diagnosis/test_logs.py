"""Logs: what a simulated machine writes is what a diagnosis reads, column by column."""

import numpy as np
import pytest

from camcomp.diagnosis.experiment.open_experiment import columns_of, open_log, read_log, unread
from camcomp.ground.errors import ConfigError
from camcomp.model.config.load import load_config
from camcomp.model.job import Job
from camcomp.model.motion.log_columns import log_columns
from camcomp.model.motion.twin import twin_of
from camcomp.terminal.cli import run
from tests.commandline import ROOT, table


@pytest.fixture(scope="module")
def columns():
    return columns_of(twin_of(Job(load_config(["config/cartesian.yaml"]))))


def read(path, text, columns):
    path.write_bytes(text)
    return read_log(open_log(str(path)), columns)


def test_what_is_simulated_is_read_in_its_channels(tmp_path, columns):
    program, config, log = ROOT / "samples/groove-circle-2.nc", ROOT / "config/cartesian.yaml", tmp_path / "log.csv"
    assert run(["simulate", str(program), "--config", str(config), "-o", str(log)]) == 0
    raw = table(log)
    assert tuple(raw) == columns.simulated
    opened = open_log(str(log))
    assert unread(opened, columns) == []
    measured = read_log(opened, columns)
    np.testing.assert_array_equal(measured.time, raw["t_s"])
    np.testing.assert_array_equal(measured.tip[:, 1], raw["y_mm"])
    np.testing.assert_array_equal(measured.setpoint[:, 0], raw["cmd_x_mm"])
    np.testing.assert_array_equal(measured.encoder[:, 2], raw["act_z_mm"])
    np.testing.assert_array_equal(measured.drive[:, 1], raw["act_y_N"])
    np.testing.assert_array_equal(measured.dyno[:, 2], raw["fz_N"])
    assert not measured.has("temperature") and not measured.has("tip_sd")


def test_the_names_of_a_log():
    """As the README has them, in the order in which a simulated machine writes them."""
    named = log_columns(["x", "c"], [False, True])
    head = "t_s,line,x_mm,y_mm,z_mm,cmd_x_mm,cmd_c_rad,act_x_mm,act_c_rad,act_x_N,act_c_Nmm,fx_N,fy_N,fz_N"
    assert ",".join(named.simulated) == head
    assert set(named.known) == {*named.simulated, *named.load, "temp_C", "x_sd_mm", "y_sd_mm", "z_sd_mm"}
    assert named.load == ("load_x_mm", "load_c_rad")


def test_the_deviation_that_an_instrument_states_is_read(tmp_path, columns):
    measured = read(tmp_path / "log.csv", b"t_s,x_mm,x_sd_mm,z_sd_mm\r0,1,0.002,\r1,2,0.003,0.004\r", columns)
    np.testing.assert_array_equal(measured.tip_sd, [[0.002, np.nan, np.nan], [0.003, np.nan, 0.004]])
    assert unread(open_log(str(tmp_path / "log.csv")), columns) == []


def test_a_time_that_is_missing_is_told_on_its_line(tmp_path, columns):
    with pytest.raises(ConfigError) as caught:
        read(tmp_path / "log.csv", b"line,t_s\n\n1,0\n1,\n", columns)
    assert (caught.value.rule, caught.value.at.line, caught.value.at.column) == ("CC401", 4, 3)
