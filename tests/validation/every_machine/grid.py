"""Effects of the library by shipped machine, with sizes and the right answers.

Sizes move the tip by 15 to 30 um (rms over the rows of all runs), 5 to 10 times the noise of one axis, except where the
machine is so stiff that even the largest sensible size moves it less (by 6 um and more).
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any
from unittest.mock import patch

import yaml

from tests.validation import runner
from tests.validation.every_machine.shipped import Fault, experiment

# machines of config/, and the actuator whose own effects are tried
MACHINES = {
    "orthoglide": "y", "delta": "b", "puu": "y", "cartesian": "y", "router": "y", "hexapod": "leg2", "kuka-kr210": "A2", "ur10": "elbow",
}  # fmt: skip
ARMS, SLIDES_IN_A_ROW = ("kuka-kr210", "ur10"), ("cartesian", "router")
OWN = "its actuator"
SURE = 0.8  # contract: confident and wrong
WARM = {"warm_up_s": 1100.0}
NEW_TOOLS = {"one_tool": 0.0}  # `simulate` begins every program with one
WHILE = {"from_s": 1.2, "to_s": 2.4}
# Effect, target, parameter, sizes in the order of MACHINES, other parameters.  No size: the machine has no such part, or
# it is so stiff there that nothing of it is seen.
SIZES: list[tuple[str, str | None, str, tuple[float | None, ...], dict[str, Any]]] = [
    ("backlash", OWN, "width_mm", (0.046, 0.05, 0.046, 0.066, 0.066, 0.11, None, None), {}),
    ("backlash", OWN, "width_rad", (None, None, None, None, None, None, 5e-5, 8.5e-5), {}),
    ("chain_error", OWN, "roll_deg", (0.067, 0.18, 0.017, 0.83, 0.0049, None, 0.0014, 0.0024), {}),
    ("cutting_force", None, "factor", (1.1, 2.3, 1.025, 4.0, 1.15, 5.0, 1.2, None), {}),
    ("disturbance", OWN, "shift_mm", (0.078, 0.081, 0.077, 0.099, 0.099, 0.17, None, None), WHILE),
    ("disturbance", OWN, "shift_rad", (None, None, None, None, None, None, 8.2e-5, 1.4e-4), WHILE),
    ("drive_stiffness", OWN, "factor", (0.37, 0.2, 0.37, 0.2, 0.2, None, 0.96, None), {}),
    ("friction", OWN, "force_N", (230.0, 130.0, 230.0, 660.0, 130.0, 2000.0, None, None), {}),
    ("friction", OWN, "force_Nmm", (None, None, None, None, None, None, 8e4, None), {}),
    ("gravity", None, "weight_N", (47.0, 310.0, 46.0, 1200.0, 100.0, 3100.0, 30.0, None), {}),
    ("joint_offset", OWN, "offset_mm", (0.023, 0.03, 0.023, 0.03, 0.03, 0.052, None, None), {}),
    ("joint_offset", OWN, "offset_rad", (None, None, None, None, None, None, 2.5e-5, 4.2e-5), {}),
    ("link_length", OWN, "length_mm", (0.021, 0.022, 0.021, None, None, 0.5, 0.03, 0.03), {}),
    ("link_stiffness", None, "factor", (0.92, 0.2, 0.975, None, 0.88, 0.15, None, None), {}),
    ("screw_cyclic", OWN, "amplitude_mm", (0.03, 0.036, 0.035, 0.041, 0.041, 0.075, None, None), {"pitch_mm": 5.0, "phase_rad": 1.0}),
    ("screw_growth", OWN, "expansion_ppm_per_K", (50.0, 13.0, 9.9, None, 24.0, None, None, None), WARM),
    ("screw_growth", None, "expansion_ppm_per_K", (21.0, 16.0, 3.8, None, 13.0, None, None, None), WARM),
    ("screw_pitch", OWN, "error_ppm", (300.0, 83.0, 61.0, 2000.0, 150.0, 2000.0, 16.0, 23.0), {}),
    ("servo_lag", OWN, "time_constant_ms", (2.0, 3.3, 2.0, 2.6, 2.6, 6.1, 2.0, 2.0), {}),
    ("servo_lag", None, "time_constant_ms", (1.6,) * 8, {}),
    ("servo_overshoot", OWN, "period_ms", (83.0, 130.0, 83.0, 90.0, 90.0, 160.0, 110.0, 89.0), {"damping": 0.2}),
    ("servo_overshoot", None, "period_ms", (83.0,) * 8, {"damping": 0.2}),
    ("squareness", "xy", "angle_mrad", (4.9,) * 8, {}),
    ("thermal_growth", OWN, "growth_mm_per_K", (0.004, 0.004, 0.004, 0.0048, 0.0048, 0.0084, None, None), WARM),
    ("thermal_growth", OWN, "growth_rad_per_K", (None, None, None, None, None, None, 4e-6, 6.8e-6), WARM),
    ("thermal_growth", None, "growth_mm_per_K", (0.0014, 0.0048, 0.0014, 0.0028, 0.0028, 0.004, 1.6e-6, 2.9e-6), WARM),
    ("time_sync", None, "offset_s", (0.0016,) * 8, {}),
    ("tool_deflection", None, "compliance_mm_per_N", (1.8e-4, 8.8e-4, 1.8e-4, 1.8e-4, 1.4e-3, 1.8e-4, 1.8e-4, None), {}),
    ("tool_length", None, "length_mm", (0.03,) * 8, {}),
    ("tool_wear", None, "growth_per_min", (2.0, 20.0, 0.71, 20.0, 4.1, None, 4.9, None), NEW_TOOLS),
    ("workpiece_frame", None, "shift_x_mm", (0.025,) * 8, {"shift_y_mm": -0.02}),
    ("axis_error", "EYX", "quadratic_um_per_m2", (None, None, None, 370000.0, 370000.0, None, None, None), {}),
    ("inertia", OWN, "factor", (None, None, None, None, None, None, 5.0, None), {}),
    ("link_growth", OWN, "growth_mm_per_K", (None, None, None, None, None, None, 0.004, 0.004), WARM),
    ("base_compliance", None, "rad_per_Nmm", (None, None, None, None, 7e-9, None, 5e-11, 1e-8), {}),
    ("speed_limit", OWN, "speed_mm_per_s", (19.9, 16.0, 16.0, 16.0, 16.0, 12.0, None, None), {}),
    ("speed_limit", OWN, "speed_rad_per_s", (None, None, None, None, None, None, 0.0133, 0.043), {}),
    ("gravity_compliance", OWN, "compliance_rad_per_Nmm", (None, None, None, None, None, None, 1.3e-11, None), {}),
]  # fmt: skip


# What a machine has no part for, or what moves its tip by less than half of the floor whatever its size; why.
NOT_THERE = {
    ("chain_error", "hexapod"): "a leg between two joints that turned about itself is the same leg",
    ("drive_stiffness", "hexapod"): "five times softer it moves the tip by 3 um",
    ("tool_wear", "hexapod"): "20 times the force within a minute moves the tip by 4 um",
    ("screw_growth", "cartesian"): "the program lies at home: 10 ppm per K move the tip by 1 um",
    ("screw_growth", "hexapod"): "the program lies at home: 10 ppm per K move the tip by 1 um",
    ("inertia", "router"): "so light and stiff that five times the masses move the tip by less than 1 um",
    ("inertia", "ur10"): "rigid joints as shipped",
    ("link_length", "cartesian"): "no link stands behind the drive",
    ("link_length", "router"): "no link stands behind the drive",
    ("link_stiffness", "cartesian"): "no springs but the drives",
    ("link_stiffness", "kuka-kr210"): "no springs but the drives",
    **{
        (each, "ur10"): "rigid joints as shipped, and no cutting force"
        for each in ("cutting_force", "drive_stiffness", "friction", "gravity", "gravity_compliance", "link_stiffness",
                     "tool_deflection", "tool_wear")
    },
}  # fmt: skip
# Never asked about where a program is driven, because so short a way shows them as offsets and lengths: where they are found.
ELSEWHERE = {
    "joint_coupling": "tests/unit/diagnosis/test_joint_curves.py",
    "joint_curve": "tests/unit/diagnosis/test_joint_curves.py",
    "joint_hysteresis": "tests/unit/diagnosis/test_joint_curves.py",  # in static poses: in programs loads move the gear's play
    "link_geometry": "tests/validation/measured/test_ur10.py",
    # no number to fit: given, or what a diagnosis makes of an unknown
    "error_table": "tests/unit/effects/test_error_table.py",
    "formula": "tests/diagnosis/test_hidden_laws.py",
    "map": "tests/diagnosis/test_found_laws.py",
    "none": "tests/diagnosis/test_every_machine.py",
}


def same_as(machine: str, fault: Fault) -> Fault:
    """Name of the effect of programs that is identical with this effect of arms."""
    if fault.effect == "gravity_compliance":  # in series with the joint's spring
        (more,) = fault.parameters.values()
        config = yaml.safe_load((runner.ROOT / "config" / f"{machine}.yaml").read_text())
        (spring,) = (j["stiffness_Nmm_per_rad"] for j in config["robot"]["joints"] if j["name"] == fault.target)
        return Fault("drive_stiffness", fault.target, {"factor": 1.0 / (1.0 + more * spring)})
    return fault


def faults(machine: str) -> Iterator[Fault]:
    """All that are tried on a machine."""
    k = list(MACHINES).index(machine)
    for effect, target, parameter, sizes, more in SIZES:
        if sizes[k] is not None:
            yield Fault(effect, MACHINES[machine] if target == OWN else target, {parameter: sizes[k], **more})


def wrong(result: dict[str, Any], fault: Fault | None) -> list[str]:
    """Faults of an answer; empty if it is right.

    Right: the cause is first or one of the alternatives, nothing else stands beside it at p above 0.5, its intervals hold
    what is true.  Where runs do not tell it from something else the other one may be named, but not as if it were sure.
    """
    named = [(each["effect"], each["target"]) for each in result["causes"]]
    if fault is None:
        return [] if (result["verdict"], named) == ("none", []) else [f"{result['verdict']} {named}"]
    out, true = [], (fault.effect, fault.target)
    listed = [[(each["effect"], each["target"]) for each in group] for group in result["alternatives"]]
    if result["verdict"] not in ("identified", "ambiguous"):
        out.append(result["verdict"])
    if named[:1] != [true] and [true] not in listed:
        out.append("not named")
    instead = len(named) == 1 and [true] in listed
    for each in result["causes"]:
        if (each["effect"], each["target"]) != true:
            if each.get("probability", 1.0) > (SURE if instead else 0.5):
                out.append(f"false {each['effect']} {each['target']}")
            continue
        for name, value in fault.parameters.items():
            if name in each["parameters"]:
                low, high = each["parameters"][name]["ci95"]
                if not low <= value <= high:
                    out.append(f"{name} {value:g} not in {low:g} to {high:g}")
    return out


def answer(folder: Path, machine: str, fault: Fault | None, seed: int = 7) -> tuple[str, list[str]]:
    """The verdict on that fault, and the faults of the answer."""
    # what to measure next takes two thirds of the time, and has tests of its own
    with patch("camcomp.diagnosis.diagnose._next", lambda *_: None):
        result = runner.ask(experiment(folder, machine, fault, seed))
    return result["verdict"], wrong(result, None if fault is None else same_as(machine, fault))
