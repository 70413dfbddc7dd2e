"""An arm that MuJoCo moves: its friction and lags are found, and no friction that MuJoCo does not have."""

import json

import numpy as np
import pytest

from tests.validation import runner

pytestmark = pytest.mark.ecosystem
pytest.importorskip("mujoco")
from tests.validation.plants import mujoco_servo as plant

RUNS = {"first": 5, "second": 16, "unseen": 27}


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    folder, runs = tmp_path_factory.mktemp("arm"), []
    for name, seed in RUNS.items():
        columns = plant.log(seed, 30.0)
        np.savetxt(folder / f"{name}.csv", np.column_stack([*columns.values()]), delimiter=",", header=",".join(columns), comments="", fmt="%.8g")  # fmt: skip
        runs.append({"name": name, "log": f"{name}.csv", "cutting": False})
    path = folder / "experiment.yaml"
    config = str(runner.ROOT / "config" / "kuka-kr210.yaml")
    path.write_text(json.dumps({"config": [config], "runs": runs, "holdout": ["unseen"]}))
    return runner.ask(path)


def of(result, effect):
    return {c["target"]: c["parameters"] for c in result["causes"] if c["effect"] == effect and c["probability"] > 0.5}


def test_friction_is_found_and_none_that_stands_still_is_made_up(result):
    """MuJoCo's friction turns round in proportion to a small speed: near standstill it is less, not more."""
    found = of(result, "friction")
    assert sorted(found) == ["A1", "A2", "A3", "A4", "A5", "A6"]
    for name, coulomb, viscous in zip(sorted(found), plant.COULOMB, plant.VISCOUS, strict=True):
        assert found[name]["force_Nmm"]["value"] == pytest.approx(1e3 * coulomb, rel=0.03)
        assert found[name]["viscous_Nmms_per_rad"]["value"] == pytest.approx(1e3 * viscous, rel=0.1)
        assert "stribeck_Nmm" not in found[name]


def test_lags_are_found(result):
    found = of(result, "servo_lag")
    for name, lag in zip((f"A{j}" for j in range(1, 7)), plant.lags_ms(), strict=True):
        assert found[name]["time_constant_ms"]["value"] == pytest.approx(lag, rel=0.05)
