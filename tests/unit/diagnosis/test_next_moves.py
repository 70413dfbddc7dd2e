"""The next experiment of an axis: strokes inside what the runs had, that tell what a leftover goes with; a table a control can drive."""

import json
from dataclasses import replace

import numpy as np
import pytest

from camcomp.diagnosis.axis.next_moves import set_points
from camcomp.diagnosis.model.noise import StatedDeviation
from camcomp.diagnosis.result.types import AxisMoves, StrokeBlock
from camcomp.terminal.cli import run
from tests.commandline import ROOT
from tests.studies import axis_study as study
from tests.unit.diagnosis.test_studies import axis_log


@pytest.fixture(scope="module")
def log():
    """A line of 5 mm in the drive force, which no effect makes; 20 s would be enough rows, every tenth is used."""
    whole = axis_log(line=2.0, step=1e-3)
    return replace(whole, **{name: getattr(whole, name)[::10] for name in ("time", "setpoint", "encoder", "force")})


@pytest.fixture(scope="module")
def found(log):
    return study({"x": [log]})


def test_strokes_stay_inside_what_the_runs_had(found, log):
    assert found.verdict == "unknown"
    moves = found.next_experiment.moves
    time, place = set_points(moves)
    speed = np.diff(place) / np.diff(time)
    assert (moves.axis, moves.unit, moves.step_s) == ("x", "mm", pytest.approx(0.01))
    assert log.encoder.min() <= place.min() < place.max() <= log.encoder.max()
    assert np.abs(speed).max() < np.abs(np.gradient(log.encoder, log.time)).max()
    assert place[0] == place[-1] == moves.blocks[0].low or len(moves.blocks) > 1
    assert found.next_experiment.minutes == pytest.approx(3.0 + time[-1] / 60.0, abs=0.06)


def test_they_tell_what_a_leftover_goes_with(found):
    """Places, speeds and ways occur in more than one combination: a function of one of them is none of another."""
    proposal = found.next_experiment
    assert 0.0 < proposal.gain < 24 * 0.5 * np.log2(1.0 + 4 * 60.0 / 0.5)  # of 24 functions in four blocks of a minute
    assert len({(each.low, each.high) for each in proposal.moves.blocks}) > 1
    assert "position" in proposal.outcomes[0] and len(proposal.outcomes) == 4
    assert proposal.separates == ("unknown",)


def test_few_rows_ask_for_more_of_them(log):
    few = replace(
        log, **{name: getattr(log, name)[:60] for name in ("time", "setpoint", "encoder")}, force=np.full(60, np.nan)
    )
    told = study({"x": [few]}, stated=StatedDeviation(encoder_mm=3e-4))
    assert told.verdict == "ambiguous"
    assert "leave no more than the noise" in told.next_experiment.outcomes[0] and told.next_experiment.moves.blocks


def test_a_healthy_axis_has_none():
    assert study({"x": [axis_log()]}).next_experiment is None


def test_a_stroke_is_trapezoidal_in_speed():
    """10 mm at 5 mm/s and 10 mm/s2 after a rest of 0.2 s: half a second up, 1.5 s steady, half a second down."""
    block = StrokeBlock(low=0.0, high=10.0, speed=5.0, times=1)
    time, place = set_points(AxisMoves(axis="x", unit="mm", blocks=(block,), acceleration=10.0, step_s=0.01))
    at = {t: p for t, p in zip(np.round(time - 0.2, 2), place, strict=True)}
    assert [at[t] for t in (0.0, 0.5, 1.0, 2.0, 2.5)] == pytest.approx([0.0, 1.25, 3.75, 8.75, 10.0])
    assert place[-1] == 0.0 and np.abs(np.diff(place)).max() <= 0.05 + 1e-9


def test_the_table_is_written_or_an_error_says_why(tmp_path, log, capsys):
    def experiment(force):
        rows = np.column_stack((log.time, log.setpoint, log.encoder, force))
        np.savetxt(tmp_path / "a.csv", rows, "%.6f", ",", header="t_s,cmd_x_mm,act_x_mm,act_x_N", comments="")
        machine = ROOT / "config/cartesian.yaml"
        (tmp_path / "e.yaml").write_text(
            f"config: [{machine}]\nruns: [{{name: a, log: a.csv, cutting: false, started_s: 0}}]\n"
        )
        return [
            "diagnose",
            str(tmp_path / "e.yaml"),
            "--json",
            str(tmp_path / "r.json"),
            "--next-program",
            str(tmp_path / "n.csv"),
        ]

    assert run(experiment(log.force)) == 0
    assert "measure next: move x alone" in capsys.readouterr().err
    moves = AxisMoves.model_validate(json.loads((tmp_path / "r.json").read_text())["next_experiment"]["moves"])
    written = np.genfromtxt(tmp_path / "n.csv", delimiter=",", names=True)
    assert written.dtype.names == ("t_s", "cmd_x_mm")
    np.testing.assert_allclose(written["cmd_x_mm"], set_points(moves)[1], atol=1e-6)
    (tmp_path / "n.csv").unlink()
    healthy = axis_log(step=1e-3)
    assert run(experiment(healthy.force[::10])) == 1
    assert "CC608" in capsys.readouterr().err and not (tmp_path / "n.csv").exists()
