"""Causes of hinges in the units of their effects: the study has way and force at the end of an arm of 1 m, in mm and N."""

from __future__ import annotations

from camcomp.diagnosis.axis.at_tip import lever_mm
from camcomp.diagnosis.axis.findings import AxisFindings
from camcomp.diagnosis.result.types import Estimate, FoundCause

# parameter of the study -> that of a hinge, and the power of the lever that leads to it
_OF_HINGES = {
    "force_N": ("force_Nmm", 1.0),
    "presliding_mm": ("presliding_rad", -1.0),
    "shift_mm": ("shift_rad", -1.0),
    "viscous_Ns_per_mm": ("viscous_Nmms_per_rad", 2.0),
    "asymmetry_Ns_per_mm": ("asymmetry_Nmms_per_rad", 2.0),
}


def in_own_unit(cause: FoundCause, axis: AxisFindings) -> FoundCause:
    """The cause with parameters in rad and N mm where its axis is a hinge."""
    if not axis.revolute:
        return cause
    lever = lever_mm(True)
    out: dict[str, Estimate] = {}
    for name, own in cause.parameters.items():
        other, power = _OF_HINGES.get(name, (name, 0.0))
        out[other] = Estimate.stated(*(each * lever**power for each in (own.value, *own.ci95)))
    return cause.model_copy(update={"parameters": out})
