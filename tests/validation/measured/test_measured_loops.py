"""camcomp on measured joints: what moves them is named, and holds on the other run."""

import json

import numpy as np
import pytest

from tests.validation import runner
from tests.validation.measured import bench, tables


@pytest.mark.parametrize("split", ["first to second", "second to first"])
def test_a_servo_in_steps_ten_times_a_second_has_a_speed_limit(split):
    (own,) = [s for s in bench.splits(("uart_servo",)) if s.name == split]
    (row,) = bench.judge(own)
    assert row["answer"] == "identified" and row["causes"] == ["speed_limit:M"]
    assert row["ratio"] < bench.ALLOWED and row["kept"]


@pytest.mark.parametrize("axis", ["A4", "A6"])
def test_the_lead_of_a_wrist_is_named_and_holds_in_the_other_run(tmp_path, axis):
    """Its set-points are logged some 80 ms late, beside something unmodelled of thousands of noise floors."""
    for run in "AB":
        columns = {key: tables.kr300(run)[key] for key in ("t_s", f"cmd_{axis}_rad", f"act_{axis}_rad")}
        np.savetxt(tmp_path / f"{run}.csv", np.column_stack([*columns.values()]), fmt="%.9g", delimiter=",", header=",".join(columns), comments="")  # fmt: skip
    lag = {}
    for fitted, held in ("AB", "BA"):
        runs = [{"name": run, "log": f"{run}.csv", "cutting": False} for run in "AB"]
        path = tmp_path / f"{fitted}.yaml"
        path.write_text(
            json.dumps({"config": [str(tables.HERE / "kr300" / "kr300.yaml")], "runs": runs, "holdout": [held]})
        )
        (cause,) = [c for c in runner.ask(path)["causes"] if c["effect"] == "servo_lag"]
        assert cause["target"] == axis and cause["probability"] > 0.3
        lag[fitted] = cause["parameters"]["time_constant_ms"]
    (low, high), (least, most) = lag["A"]["ci95"], lag["B"]["ci95"]
    assert max(low, least) < min(high, most) < 0.0
