"""Simulated logs of every shipped machine at ten places: no plausibility check refuses one.

The truth is the purpose of the checks: a log in the right units, rows and order of columns is valid, whatever forces act on
the machine and wherever its workpiece is clamped.
"""

import numpy as np
import pytest
import yaml

from camcomp.diagnosis.experiment.open_experiment import open_experiment
from camcomp.diagnosis.studies import checked_axes, checked_poses, open_logs
from camcomp.ground.errors import ConfigError
from camcomp.model.config.load import read_experiment
from camcomp.terminal.cli import run
from tests.commandline import ROOT, table

MACHINES = (
    "cartesian", "delta", "hexapod", "kuka-kr210", "orthoglide", "orthoglide-1deg", "puu", "router", "ur10"
)  # fmt: skip
REACH_MM = {"kuka-kr210": 350.0, "ur10": 150.0, "hexapod": 80.0, "cartesian": 900.0}
ARMS = ("cartesian", "kuka-kr210", "router", "ur10")
TIP = ("x_mm", "y_mm", "z_mm")


def simulated(folder, machine, number, *more_words):
    """The log of a groove with its workpiece at a place drawn by number; None out of reach."""
    rng = np.random.default_rng([MACHINES.index(machine), number])
    config = ROOT / "config" / f"{machine}.yaml"
    nominal = yaml.safe_load(config.read_text())
    at = np.array(nominal["workpiece"]["origin_mm"], float)
    reach = REACH_MM.get(machine, 20.0)
    force = rng.choice([30.0, 300.0, 900.0])
    more = {
        "workpiece": {"origin_mm": [float(v) for v in np.round(at + rng.uniform(-reach, reach, 3) * (number > 0), 1)]},
        "process": {"force": {"model": "constant", "Fr_N": float(force), "Ft_N": -0.1 * float(force), "Fz_N": -20.0}},
    }
    (folder / "place.yaml").write_text(yaml.safe_dump(more))
    program = ROOT / "samples/groove-circle-2.nc"
    configs = [str(config), str(folder / "place.yaml")]
    words = [word for each in (*configs, *more_words) for word in ("--config", each)]
    done = run(["simulate", str(program), *words, "--step-s", "0.05", "-o", str(folder / "log.csv")])
    return (configs, program) if done == 0 else None


def experiment(folder, configs, columns, **keys):
    """An experiment of one run with some columns of the simulated log."""
    log = table(folder / "log.csv")
    kept = [name for name in log if columns(name)]
    rows = np.column_stack([log[name] for name in kept])
    np.savetxt(folder / "some.csv", rows, fmt="%.7f", delimiter=",", header=",".join(kept), comments="")
    path = folder / "experiment.yaml"
    runs = [{"name": "a", "log": "some.csv", **keys}]
    path.write_text(yaml.safe_dump({"config": configs, "runs": runs}))
    return path


def check_every_kind(folder, machine, number):
    """Opens the log as that of a program, of axes, and of static poses; raises where one is refused."""
    found = simulated(folder, machine, number)
    if found is None:
        return False
    configs, program = found
    open_experiment(experiment(folder, configs, lambda name: True, program=str(program), cutting=True))
    of_control = ("cmd_", "act_", "t_s")
    alone = experiment(folder, configs, lambda name: name.startswith(of_control), cutting=True)
    checked_axes(open_logs(read_experiment(alone)))
    if machine in ARMS:
        simulated(folder, machine, number, str(ROOT / "config/no-force.yaml"))
        static = experiment(
            folder, configs, lambda name: name.startswith(("act_", "t_s")) or name in TIP, cutting=False
        )
        checked_poses(open_logs(read_experiment(static)))
    return True


@pytest.mark.parametrize("machine", ["cartesian", "kuka-kr210", "ur10"])
def test_a_simulated_log_is_not_refused(tmp_path, machine):
    assert check_every_kind(tmp_path, machine, 1)


@pytest.mark.campaign
@pytest.mark.parametrize("machine", MACHINES)
def test_no_simulated_log_at_ten_places_is_refused(tmp_path, machine):
    reached = sum(check_every_kind(tmp_path, machine, number) for number in range(14))
    assert reached >= 10


def test_torques_in_newton_metres_are_refused(tmp_path):
    configs, program = simulated(tmp_path, "kuka-kr210", 0)
    log = table(tmp_path / "log.csv")
    torques = [name for name in log if name.endswith("_Nmm")]
    rows = np.column_stack([values / (1e3 if name in torques else 1.0) for name, values in log.items()])
    np.savetxt(tmp_path / "log.csv", rows, fmt="%.7f", delimiter=",", header=",".join(log), comments="")
    path = experiment(tmp_path, configs, lambda name: True, program=str(program), cutting=True)
    with pytest.raises(ConfigError, match="drive torques look as if logged in N m") as caught:
        open_experiment(path)
    assert caught.value.rule == "CC407"
