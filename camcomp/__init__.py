"""camcomp: writes the deflection of the machine back into the NC program, and says why machine and model differ.

The names below are imported when they are first asked for: `import camcomp` itself costs nothing.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

__version__ = "0.2.0"

if TYPE_CHECKING:
    from camcomp.api.compensation import CompensatedProgram, compensate
    from camcomp.api.diagnosis import ExperimentDiagnosis, diagnose
    from camcomp.api.machine import Job, Program, load_machine, read_program
    from camcomp.api.result_table import ResultTable
    from camcomp.api.set_points import Stream
    from camcomp.api.simulation import SimulatedLog, simulate
    from camcomp.api.verification import Verified, verify
    from camcomp.ground.errors import CamcompError

__all__ = [
    "CamcompError",
    "CompensatedProgram",
    "ExperimentDiagnosis",
    "Job",
    "Program",
    "ResultTable",
    "SimulatedLog",
    "Stream",
    "Verified",
    "compensate",
    "diagnose",
    "load_machine",
    "read_program",
    "simulate",
    "verify",
]

_HOMES = {
    "api.compensation": ("CompensatedProgram", "compensate"),
    "api.diagnosis": ("ExperimentDiagnosis", "diagnose"),
    "api.machine": ("Job", "Program", "load_machine", "read_program"),
    "api.result_table": ("ResultTable",),
    "api.set_points": ("Stream",),
    "api.simulation": ("SimulatedLog", "simulate"),
    "api.verification": ("Verified", "verify"),
    "ground.errors": ("CamcompError",),
}


def __getattr__(name: str) -> Any:
    """A name of the interface, from where it lives."""
    for home, names in _HOMES.items():
        if name in names:
            found = globals()[name] = getattr(import_module(f"{__name__}.{home}"), name)
            return found
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__])
