"""Error tables of a slide as the tables of controllers, in CSV.

SINUMERIK (leadscrew error compensation, LEC): a positive value moves the axis in the negative direction (Function Manual,
"Compensations"), so a value is the error itself. It has one value per position, the mean of both directions; the
difference belongs into the backlash compensation. HEIDENHAIN (*.COM): AXISPOS, the axis in the positive direction, and
BACKLASH, the values in the negative direction (Technical Manual, "Axis-error compensation"); the values here are errors.
"""

from __future__ import annotations

import numpy as np

from camcomp.ground.errors import ConfigError
from camcomp.model.error_table.table import ErrorTable, comp_text

CONTROLS = ("linuxcnc", "siemens", "heidenhain")


def table_text(table: ErrorTable, control: str, axis: str, comp_type: int = 0) -> str:
    """Text of a control's table for a slide. Raises ConfigError CC205 where the control needs equal steps and has none."""
    if control == "siemens":
        return _siemens(table, axis)
    if control == "heidenhain":
        rows = zip(table.position, table.forward, table.reverse, strict=True)
        return f"AXISPOS,{axis.upper()},BACKLASH\n" + "".join(
            f"{p:.4f},{f + 0.0:.6f},{r + 0.0:.6f}\n" for p, f, r in rows
        )
    return comp_text(table, comp_type)


def _siemens(table: ErrorTable, axis: str) -> str:
    steps = np.diff(table.position)
    if np.ptp(steps) > 1e-9 * abs(table.position).max():
        hint = "choose --step-mm so that it divides the travel"
        raise ConfigError("CC205", f"the last step is {steps[-1]:g} mm instead of {steps[0]:g} mm", hint=hint)
    name = f"{axis.upper()}1"
    lines = ["variable,value"]
    lines += [f"$AA_ENC_COMP_{key}[0,{name}],{value:.4f}" for key, value in
              (("STEP", steps[0]), ("MIN", table.position[0]), ("MAX", table.position[-1]))]  # fmt: skip
    lines.append(f"$AA_ENC_COMP_IS_MODULO[0,{name}],0")
    mean = 0.5 * (table.forward + table.reverse)
    lines += [f"$AA_ENC_COMP[0,{k},{name}],{value + 0.0:.6f}" for k, value in enumerate(mean)]
    return "\n".join(lines) + "\n"
