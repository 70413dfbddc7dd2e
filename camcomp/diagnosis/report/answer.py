"""The answer of a diagnosis in words, for the terminal and the report."""

from __future__ import annotations

from collections.abc import Sequence

from camcomp.diagnosis.result.types import DiagnosisResult, Estimate, GapSize, NamedCause
from camcomp.report.plot import brief


def cause_name(cause: NamedCause) -> str:
    """`effect (target)`."""
    return f"{cause.effect} ({cause.target})" if cause.target else cause.effect


def verdict_text(result: DiagnosisResult) -> str:
    """The answer in a sentence or two."""
    gap, shrink = result.gap, result.shrinkage
    floor = floor_text(gap)
    told = (
        f"On runs that the fit has not seen the gap goes from {brief(shrink.before_rms_um)} µm to "
        f"{brief(shrink.after_rms_um)} µm (rms); the noise floor is {floor}."
        if shrink
        else f"There is no run that the fit has not seen; the noise floor is {floor}."
    )
    known = [cause_name(each) for each in result.known]
    if result.verdict == "none":
        return (
            f"Measurement and model differ by {brief(gap.rms_um)} µm (rms), which is the noise floor of {floor}: there "
            "is nothing to explain."
        )
    if result.verdict == "identified":
        return f"{together(known)} {'explain' if len(known) > 1 else 'explains'} the gap. {told}"
    if result.verdict == "ambiguous":
        sets = [together([cause_name(each) for each in one]) or "nothing but noise" for one in result.alternatives]
        return f"These runs cannot tell apart: {'; or '.join(sets)}. {told}"
    rest = f" {together(known)} {'are' if len(known) > 1 else 'is'} identified." if known else ""
    drivers = ", ".join(each.covariate for each in result.where.drivers[:3])
    what = f" The rest depends on {drivers}." if drivers else ""
    return f"Something is at work that no effect of the library explains.{rest}{what} {told}"


def floor_text(gap: GapSize) -> str:
    """The noise floor, or that nothing tells it."""
    return "not known" if gap.noise_floor_um is None else f"{brief(gap.noise_floor_um)} µm"


def together(names: Sequence[str]) -> str:
    """`a, b and c`."""
    return ", ".join(names[:-1]) + " and " + names[-1] if len(names) > 1 else "".join(names)


def parameter_text(name: str, each: Estimate) -> str:
    """A value with its 95 % interval."""
    low, high = each.ci95
    return f"{name} = {brief(each.value, 4)} ({brief(low, 4)} to {brief(high, 4)})"


def answer_lines(result: DiagnosisResult) -> list[str]:
    """The answer in a few lines: verdict, causes with their values, what to measure next."""
    lines = [f"{result.verdict}: {verdict_text(result)}"]
    for cause in result.causes:
        share, chance = f"{100 * cause.share:.0f} % of the gap", f"probability {100 * cause.probability:.1f} %"
        lines.append(f"  {cause_name(cause)}: {share}, {chance}")
        lines += [f"    {parameter_text(name, each)}" for name, each in cause.parameters.items()]
    shrink = result.shrinkage
    if result.causes and shrink:
        low, high = shrink.ci95
        lines.append(f"  removed on unseen runs: {100 * shrink.ratio:.0f} % ({100 * low:.0f} to {100 * high:.0f} %)")
    if proposal := result.next_experiment:
        lines.append(f"  measure next: {proposal.action}")
    return [each.replace("µm", "um") for each in lines]
