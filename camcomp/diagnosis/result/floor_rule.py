"""What the noise floor allows a result to state: a gap below it is `none`, a residual below it is no `unknown`."""

from __future__ import annotations

from camcomp.diagnosis.model.verdict import SURE
from camcomp.diagnosis.result.types import UNKNOWN, DiagnosisResult, UnknownCause, UnseenShrinkage, alternatives_of
from camcomp.diagnosis.statistics.probability import EVEN


def within_floor(result: DiagnosisResult, *, in_forces: bool = False) -> DiagnosisResult:
    """The result with the verdict that its noise floor allows; the only place where verdicts and floors meet.

    in_forces: the unmodelled part shows in forces, which positions at their floor do not exclude.
    """
    floor, unseen, actuators = result.gap.noise_floor_um, result.shrinkage, result.gap.actuators.values()
    in_positions = not actuators or any(each.rms > each.floor for each in actuators)
    if floor is None or result.verdict == "none" or not in_positions or result.gap.at_actuators_alone:
        return result
    if result.gap.rms_um <= floor:
        return _without_gap(result)
    if result.verdict == UNKNOWN and unseen is not None and unseen.after_rms_um < floor and not in_forces:
        return _without_unknown(result)
    return result


def _without_gap(result: DiagnosisResult) -> DiagnosisResult:
    """The verdict `none`, which claims no shrinkage."""
    unseen = result.shrinkage
    return result.model_copy(
        update={
            "verdict": "none", "causes": (), "alternatives": (), "next_experiment": None, "axis_laws": (),
            "shrinkage": None if unseen is None else _unchanged(unseen),
        }
    )  # fmt: skip


def _unchanged(unseen: UnseenShrinkage) -> UnseenShrinkage:
    """The shrinkage without any cause."""
    before = unseen.before_rms_um
    actuators = {n: a.model_copy(update={"after_rms": a.before_rms}) for n, a in unseen.actuators.items()}
    return unseen.model_copy(
        update={"after_rms_um": before, "ratio": 0.0, "ci95": (0.0, 0.0), "steps": (), "covered_rms_um": None,
                "actuators": actuators}
    )  # fmt: skip


def _without_unknown(result: DiagnosisResult) -> DiagnosisResult:
    """Known causes alone; without any, `ambiguous` between nothing and something unmodelled."""
    known = result.known
    if known and all(c.probability >= SURE for c in known) and not result.alternatives:
        return result.model_copy(update={"verdict": "identified", "causes": known})
    rest = tuple(
        c.model_copy(update={"probability": EVEN, "law": None}) for c in result.causes if isinstance(c, UnknownCause)
    )
    alternatives = result.alternatives or alternatives_of([c.named for c in known])
    return result.model_copy(update={"verdict": "ambiguous", "causes": known or rest, "alternatives": alternatives})
