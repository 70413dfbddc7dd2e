"""Statements of one diagnosis that contradict each other, whatever kind of study it is of."""

from camcomp.diagnosis.report.answer import answer_lines
from camcomp.diagnosis.result.types import DiagnosisResult

EVEN = 0.5  # probability above which a cause counts as present


def contradictions(result):
    """Sentences, none for a consistent result (JSON object)."""
    gap, verdict, causes = result["gap"], result["verdict"], result["causes"]
    floor, unseen = gap["noise_floor_um"], result["shrinkage"]
    known = [each for each in causes if each["effect"] != "unknown"]
    found = []
    if (verdict == "none") != (not causes):
        found.append(f"{verdict} with {len(causes)} causes")
    if verdict == "identified" and any(each["probability"] <= EVEN for each in known):
        found.append("identified is a cause that is improbable")
    if verdict == "identified" and len(known) < len(causes):
        found.append("identified beside an unknown cause")
    if verdict == "unknown" and len(known) == len(causes):
        found.append("unknown without an unknown cause")
    if verdict != "unknown" and len(known) < len(causes) and verdict != "ambiguous":
        found.append(f"{verdict} with an unknown cause")
    if (verdict == "ambiguous") != bool(result["alternatives"]):
        found.append(f"{verdict} with {len(result['alternatives'])} alternatives")
    if floor is not None and verdict != "none" and gap["rms_um"] <= floor and _is_of_positions(gap):
        found.append(f"{verdict} below the floor: {gap['rms_um']} of {floor}")
    if floor is not None and verdict == "unknown" and unseen and unseen["after_rms_um"] < floor:
        found.append(f"unknown is what is below the floor: {unseen['after_rms_um']} of {floor}")
    if unseen and abs(unseen["ratio"] - (1.0 - unseen["after_rms_um"] / max(unseen["before_rms_um"], 1e-9))) > 0.01:
        found.append("the ratio is not that of the sizes")
    for line in answer_lines(DiagnosisResult.model_validate(result)):
        if "probability" in line and ("not determined" in line or "not told" in line):
            improbable = all(each["probability"] <= EVEN for each in known if each["effect"] in line)
            parts = [part for part in line.split(";") if "not determined" not in part and "(" in part]
            if not improbable and not parts:
                found.append(f"probable and not determined: {line}")
    return found


def _is_of_positions(gap):
    """Whether the gap is one of positions; that of logs of forces alone is stated in mN, and a force may show more than positions."""
    return not gap["actuators"] or any(each["rms"] > each["floor"] for each in gap["actuators"].values())
