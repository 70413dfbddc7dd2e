"""An arm that MuJoCo moves: its friction and lags are found, and no friction that MuJoCo does not have."""

import json

import numpy as np
import pytest

from tests.validation import runner

pytestmark = pytest.mark.ecosystem
pytest.importorskip("mujoco")
from tests.validation.plants import mujoco_servo as plant

RUNS = {"first": 5, "second": 16, "unseen": 27}


def experiment(folder, channels, **arm):
    """File of an experiment with the channels of the arm's logs whose names end so."""
    runs = []
    for name, seed in RUNS.items():
        columns = {
            key: values for key, values in plant.log(seed, 30.0, **arm).items() if key.endswith(("_s", *channels))
        }
        np.savetxt(folder / f"{name}.csv", np.column_stack([*columns.values()]), delimiter=",", header=",".join(columns), comments="", fmt="%.8g")  # fmt: skip
        runs.append({"name": name, "log": f"{name}.csv", "cutting": False})
    path = folder / "experiment.yaml"
    config = str(runner.ROOT / "config" / "kuka-kr210.yaml")
    path.write_text(json.dumps({"config": [config], "runs": runs, "holdout": ["unseen"]}))
    return path


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    return runner.ask(experiment(tmp_path_factory.mktemp("arm"), ("rad", "Nmm")))


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


def test_the_loads_of_stated_masses_explain_what_they_do_to_the_loops(tmp_path):
    """Without friction, and with loops that do not make up for the weight: 0.2 to 0.4 mrad of 27 to 51 are left."""
    found = runner.ask(experiment(tmp_path, ("rad",), held=False, rubs=False))["shrinkage"]["actuators"]
    assert len(found) == 6
    for own in found.values():
        assert own["after_rms"] < min(500.0, 0.02 * own["before_rms"])
