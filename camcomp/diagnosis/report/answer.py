"""Text of the result of a diagnosis, for the terminal and the report."""

from __future__ import annotations

from camcomp.diagnosis.law.words import listed
from camcomp.diagnosis.model.verdict import SURE
from camcomp.diagnosis.report.words import depends, percent, plain, remedy, shortened, sizes, term_size
from camcomp.diagnosis.result.types import UNKNOWN, DiagnosisResult, FoundCause, GapSize, Law
from camcomp.diagnosis.statistics.probability import EVEN
from camcomp.report.plot import brief, micrometres

MOST_CAUSES = 3  # causes printed on the terminal
MOST_LINES = 10  # lines on the terminal; outcomes beyond them are on the page only


def verdict_text(result: DiagnosisResult) -> str:
    """The verdict in one or two sentences."""
    gap, shrink = result.gap, result.shrinkage
    floor = floor_text(gap)
    told = (
        f"On runs that the fit has not seen the gap goes from {micrometres(shrink.before_rms_um)} to "
        f"{micrometres(shrink.after_rms_um)} (rms); the noise floor is {floor}."
        if shrink
        else f"Every run is in the fit, so the prediction of an unseen one is not checked; the noise floor is {floor}."
    )
    if not result.known and result.verdict == UNKNOWN:
        told = f"The gap is {micrometres(gap.rms_um)} (rms), the noise floor {floor}."
    if gap.at_actuators_alone:
        each = [f"{name} errs by {brief(own.rms)} {own.unit} (rms)" for name, own in gap.actuators.items()]
        told = f"No error moves the tip: {listed(each)}."
    known = [each.label for each in result.known]
    if result.verdict == "none":
        return (
            f"Measurement and model differ by {micrometres(gap.rms_um)} (rms), which is no more than noise (floor {floor}): "
            "there is nothing to explain."
        )
    if result.verdict == "identified":
        return f"{listed(known)} {'explain' if len(known) > 1 else 'explains'} the gap. {told}"
    if result.verdict == "ambiguous":
        sets = [listed([each.label for each in one]) or "nothing but noise" for one in result.alternatives]
        return f"These runs cannot tell apart: {'; or '.join(sets)}. {told}"
    known = [each.label for each in result.known if each.probability > EVEN]
    maybe = [each.label for each in result.known if each.probability <= EVEN]
    if len(known) > MOST_CAUSES:
        strongest = [each for each in by_share(result) if each.probability > EVEN][:MOST_CAUSES]
        known = [*(each.label for each in strongest), f"{len(known) - MOST_CAUSES} more"]
    subject = "The rest" if known else "It"
    rest = f" {listed(known)} {'are' if len(known) > 1 else 'is'} identified." if known else ""
    rest += f" {listed(maybe[:MOST_CAUSES])} may be a part of it." if maybe else ""
    drivers = [depends(each) for each in result.where.drivers if each.share >= EVEN][:2] or [
        depends(each) for each in result.where.drivers[:1]
    ]
    unknown = next((each for each in result.causes if each.effect == UNKNOWN), None)
    aimed = (
        f"{' of' if known else ' moves'} {unknown.target}{'' if known else ' and'}"
        if unknown is not None and unknown.target
        else ""
    )
    what = f" {subject}{aimed} depends on {listed(drivers)}." if drivers else ""
    return f"Something is at work that no effect of the library explains.{rest}{what} {told}"


def by_share(result: DiagnosisResult) -> list[FoundCause]:
    """The known causes by falling share of the gap."""
    return sorted(result.known, key=lambda each: -each.share)


def floor_text(gap: GapSize) -> str:
    """Text of the noise floor, or of its absence."""
    return "not known" if gap.noise_floor_um is None else micrometres(gap.noise_floor_um)


def probability_text(probability: float) -> str:
    """Text of a probability that is not above SURE, else empty."""
    return "" if probability > SURE else f", probability {100 * probability:.0f} %"


def law_lines(law: Law) -> list[str]:
    """A law in a few lines: description, formula with the size of every term, envelope, reduction of the gap."""
    seen = ", ".join(f"{name} {brief(low, 4)} to {brief(high, 4)}" for name, (low, high) in law.envelope.items())
    said = law.says
    gone = f"from {brief(law.before_rms_um)} µm to {brief(law.after_rms_um)} µm"
    if law.after_rms_um < law.before_rms_um:  # a law of a drive force does not reduce the gap
        said += f" On parts of the data that it was not fitted to it takes the gap {gone} (rms)."
    lines = [said, shortened(law.formula)]
    if law.kind == "formula":
        lines += [term_size(each) for each in law.terms]
    return [*lines, f"seen for {seen}"] if seen else lines


def answer_lines(result: DiagnosisResult) -> list[str]:
    """The result in at most ten lines: verdict, causes with sizes and remedies, next experiment."""
    lines = [f"{result.verdict}: {verdict_text(result)}"]
    told = by_share(result)[: 1 if result.law else MOST_CAUSES]
    for cause in told:
        size = f"; {found}" if (found := sizes(cause)) else ""
        share = f"{percent(cause.share)} of the gap{probability_text(cause.probability)}"
        lines.append(f"  {cause.label}: {plain(cause)}{size}; {share}")
        if result.verdict != "ambiguous" and (what := remedy(cause)):
            lines.append(f"    do: {what}")
    if more := by_share(result)[len(told) :]:
        lines.append(f"  and {len(more)} more with {percent(sum(each.share for each in more))} of the gap together")
    if law := result.law:
        lines += [f"  {each}" for each in law_lines(law)[: MOST_LINES - len(lines) - 2]]
    shrink = result.shrinkage
    if result.known and shrink:
        low, high = shrink.ci95
        lines.append(f"  removed on unseen runs: {100 * shrink.ratio:.0f} % ({100 * low:.0f} to {100 * high:.0f} %)")
    if proposal := result.next_experiment:
        lines.append(f"  measure next: {proposal.action}")
        lines += [f"    {each}" for each in proposal.outcomes[: max(MOST_LINES - len(lines), 0)]]
    return [each.replace("µm", "um") for each in lines]
