"""The plainest test of the diagnosis, on every shipped machine: `camcomp simulate`, a little noise, `camcomp diagnose`.

A smoke test of the plumbing and of the gate, not of physics: the model itself writes the logs here (truth plants stand
in tests/trials and tests/plants).  Tip: 3 um of white noise per axis; encoders: rounded to 0.5 um, or as much at the reach of an arm.
"""

import json

import numpy as np
import pytest

from tests.campaign import runner

HEAD = "G21 G90 G17 G94\nS18000 M3\n"
PROGRAMS = {
    "left": f"{HEAD}G0 X10 Y0 Z5\nG1 Z0 F300\nG3 X10 Y0 I-10 J0 F1200\nG0 Z5\nM5\nM30\n",
    "right": f"{HEAD}G0 X10 Y0 Z5\nG1 Z0 F300\nG2 X10 Y0 I-10 J0 F900\nG0 Z5\nM5\nM30\n",
    "ramps": f"{HEAD}G0 X-12 Y-8 Z9\nG1 X12 Y-4 Z0 F1500\nG1 Y6 Z2\nG1 X-12 Y8 Z-3\nG1 Y-8 Z4\nG0 Z9\nM5\nM30\n",
}
AIR = "ramps"
TIP_MM = 0.003
ENCODER = {"mm": 5e-4, "rad": 2e-7}
STEP_S = 0.03
FORCE = ("cutting_force", None, {"factor": 1.3})
NEW_TOOLS = ("tool_wear", None, {"growth_per_min": 2.0, "one_tool": 0.0})  # `simulate` begins every program with one
CASES = {
    "orthoglide": (FORCE, ("backlash", "y", {"width_mm": 0.02}), NEW_TOOLS),
    "delta": (FORCE, ("backlash", "b", {"width_mm": 0.02})),
    "puu": (FORCE, ("backlash", "x", {"width_mm": 0.02})),
    "cartesian": (FORCE, ("backlash", "y", {"width_mm": 0.02})),
    "router": (FORCE, ("backlash", "x", {"width_mm": 0.02})),
    "kuka-kr210": (FORCE, ("joint_offset", "A2", {"offset_rad": 1e-4})),
}
# on so short a way the workpiece, another length or scale of a joint do the same
ALIKE = {("kuka-kr210", "joint_offset")}


def trials():
    """Every machine with nothing wrong, and with each cause alone."""
    for machine, causes in CASES.items():
        for cause in (None, *causes):
            yield pytest.param(machine, cause, id=f"{machine}-{cause[0] if cause else 'null'}")


def simulated(folder, machine, cause):
    """An experiment of all programs on the shipped machine with that cause; its path."""
    config, wrong = runner.ROOT / "config" / f"{machine}.yaml", folder / "wrong.yaml"
    effects = []
    if cause is not None:
        effect, target, parameters = cause
        effects = [{"effect": effect, **({"target": target} if target else {}), **parameters}]
    wrong.write_text(json.dumps({"effects": effects}))
    rng, runs = np.random.default_rng(7), []
    for k, (name, program) in enumerate(PROGRAMS.items()):
        source, log, begun = folder / f"{name}.nc", folder / f"{name}.csv", 100 * k
        source.write_text(program)
        arguments = ["simulate", str(source), "--config", str(config), "--config", str(wrong), "-o", str(log)]
        arguments += ["--step-s", str(STEP_S), "--started-s", str(begun), *(["--air"] if name == AIR else [])]
        code, said = runner.invoke(arguments)
        assert code == 0, said
        blur(log, rng)
        runs.append({"name": name, "program": source.name, "log": log.name, "cutting": name != AIR, "started_s": begun})
    path = folder / "experiment.yaml"
    path.write_text(json.dumps({"config": [str(config)], "runs": runs}))
    return path


def blur(log, rng):
    """Puts noise on the tip and rounds the encoders of a log."""
    header, table = log.read_text().partition("\n")[0], np.loadtxt(log, delimiter=",", skiprows=1)
    for i, name in enumerate(header.split(",")):
        step = ENCODER.get(name.rpartition("_")[2]) if name.startswith("act_") else None
        if name in ("x_mm", "y_mm", "z_mm"):
            table[:, i] += rng.normal(0, TIP_MM, len(table))
        elif step:
            table[:, i] = np.round(table[:, i] / step) * step
    np.savetxt(log, table, fmt="%.7f", delimiter=",", header=header, comments="")


@pytest.mark.parametrize(("machine", "cause"), list(trials()))
def test_what_is_wrong_is_named_and_nothing_else(machine, cause, tmp_path):
    result = runner.ask(simulated(tmp_path, machine, cause))
    named = [(each["effect"], each["target"]) for each in result["causes"]]
    if cause is None:
        assert (result["verdict"], named) == ("none", [])
        return
    effect, target, parameters = cause
    word = "ambiguous" if (machine, effect) in ALIKE else "identified"
    assert (result["verdict"], named) == (word, [(effect, target)])
    for name, value in parameters.items():
        low, high = result["causes"][0]["parameters"][name]["ci95"]
        assert low <= value <= high
