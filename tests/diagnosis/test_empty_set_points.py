"""Empty cells of set-points: what one actuator was told is not lost with what another one was, and nothing is made up between rows.

LinuxCNC's planner brakes and turns at every corner; a set-point there lies far beside the line between its neighbours.
"""

import numpy as np
import pytest

from camcomp.api.diagnosis import diagnose
from camcomp.diagnosis.experiment.driven_run import _guessed
from tests.validation.every_machine import shipped


@pytest.mark.parametrize("encoders", [True, False])
def test_a_machine_with_nothing_wrong_stays_one(tmp_path, encoders):
    path = shipped.experiment(tmp_path, "cartesian", None)
    rng = np.random.default_rng(3)
    for name in shipped.PROGRAMS:
        header, table = shipped.read(tmp_path / f"{name}.csv")
        for i, column in enumerate(header):
            if column.startswith("cmd_"):
                table[rng.uniform(size=len(table)) < 0.1, i] = np.nan
        kept = [i for i, column in enumerate(header) if encoders or not column.startswith("act_")]
        rows = [",".join("" if np.isnan(v) else f"{v:.7f}" for v in row) for row in table[:, kept]]
        (tmp_path / f"{name}.csv").write_text("\n".join([",".join(header[i] for i in kept), *rows]) + "\n")
    result = diagnose(path).result
    assert (result.verdict, result.causes) == ("none", ())
    assert result.gap.max_um < 25.0  # of 3 um per axis in a thousand rows


def test_what_stands_between_its_neighbours_is_known_and_what_turns_is_not():
    time = 0.1 * np.arange(9)
    even, turning = 5.0 * time, 5.0 * np.abs(time - 0.4)
    for empty in (1, 4, 7):
        there = np.arange(9) != empty
        assert not _guessed(time, np.where(there, even, np.nan), 1e-3).any()
        guessed = _guessed(time, np.where(there, turning, np.nan), 1e-3)
        assert guessed[empty] == (empty == 4) and guessed.sum() == (empty == 4)
    assert _guessed(time, np.where((time < 0.05) | (time > 0.55), even, np.nan), 1e-3).sum() == 5  # too long a gap
    assert _guessed(time, np.where(time > 0.15, even, np.nan), 1e-3).tolist() == [True] * 2 + [False] * 7
