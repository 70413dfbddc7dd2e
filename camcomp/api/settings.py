"""Values in force in YAML files, screw files for LinuxCNC, and schemas of inputs and results."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from camcomp.model.config.in_force import values_in_force
from camcomp.model.config.load import load_config
from camcomp.model.config.schema import config_schema, experiment_schema, result_schema
from camcomp.model.error_table.table import comp_text
from camcomp.model.job import Job
from camcomp.model.screw_map import screw_map


def values(configs: Sequence[str]) -> list[tuple[str, str, str]]:
    """(key, value, location) of all values in force in a machine's files, defaults included."""
    return list(values_in_force(load_config(configs), folders=True))


def screw_file(machine: Job, actuator: str, start: float, end: float, step: float, comp_type: int = 0) -> bytes:
    """LinuxCNC's screw file (COMP_FILE) that compensates for the effects in one drive, mm; comp_type as COMP_FILE_TYPE.

    Raises ConfigError CC205 for an actuator that is no slide, or a travel without rows.
    """
    return comp_text(screw_map(machine, actuator, start, end, step), comp_type).encode()


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
