"""Values in force in YAML files, screw files for LinuxCNC, and schemas of inputs and results."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from camcomp.model.config.in_force import values_in_force
from camcomp.model.config.load import load_config
from camcomp.model.config.schema import config_schema, experiment_schema, result_schema
from camcomp.model.error_table.controls import table_text
from camcomp.model.firmware_skew import skew_command
from camcomp.model.job import Job
from camcomp.model.screw_map import screw_map


def values(configs: Sequence[str]) -> list[tuple[str, str, str]]:
    """(key, value, location) of all values in force in a machine's files, defaults included."""
    return list(values_in_force(load_config(configs), folders=True))


def screw_file(
    machine: Job, actuator: str, travel: tuple[float, float, float], control: str = "linuxcnc", comp_type: int = 0
) -> bytes:
    """A control's table that makes up for the machine's effects in one drive: LinuxCNC (COMP_FILE), Siemens, Heidenhain.

    Args:
        machine: the machine with its effects.
        actuator: name of the slide.
        travel: start, end and step of the table, mm.
        control: one of linuxcnc, siemens, heidenhain.
        comp_type: COMP_FILE_TYPE of LinuxCNC.

    Raises:
        ConfigError: CC205, the actuator is no slide, the travel has no rows, or its steps are unequal for Siemens.
    """
    return table_text(screw_map(machine, actuator, *travel), control, actuator, comp_type).encode()


def skew(machine: Job, control: str) -> bytes:
    """The command by which a firmware, marlin or klipper, corrects the squareness of the machine. Raises ConfigError CC205."""
    return skew_command(machine, control).encode()


def schema_of(kind: str) -> dict[str, Any]:
    """JSON schema (draft-07) of machine files (config), experiment files, or of a result: diagnosis, summary, verify."""
    if kind == "config":
        return config_schema()
    if kind == "experiment":
        return experiment_schema()
    if kind == "diagnosis":
        from camcomp.diagnosis.result.types import DiagnosisResult

        return result_schema(DiagnosisResult, "camcomp diagnose --json")
    from camcomp.compensation.program.result import Summary, Verification

    if kind == "summary":
        return result_schema(Summary, "camcomp compensate --summary")
    return result_schema(Verification, "camcomp verify --json")
