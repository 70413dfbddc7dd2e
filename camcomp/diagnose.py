"""Where logs and model differ, which effect is the cause, how far the gap shrinks with it, and what to measure next.

Reads like the question: put the runs on the bench, open the inquiry, survey the causes, look at what is left, try the
answer on runs it has not seen.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from camcomp.alike import classes, likeness
from camcomp.bench import Bench, Run
from camcomp.columns import atoms_of
from camcomp.datatypes import Floats
from camcomp.exploring import explore
from camcomp.gap import where
from camcomp.gap.effect import Cause
from camcomp.gap.evidence import estimate
from camcomp.gap.search import Fitted, total
from camcomp.heldout import shrinkage_of
from camcomp.inquiry import Inquiry, open_inquiry
from camcomp.intervals import joint_covariance
from camcomp.job import Job
from camcomp.locate import channel_axes, gap_of, main_channels, patterns_of, rest_by_actuator, run_gaps
from camcomp.planner import Proposal, propose
from camcomp.remainder import firm_prior, leftovers
from camcomp.survey import Survey, survey
from camcomp.twin import Twin

MOST = 0.6  # share of what is unknown from which on it is one actuator's
RIVALS = 8  # sets that one experiment is asked to tell from the answer


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """The result as a mapping of the result file, and what a report may want to draw."""

    result: dict[str, Any]
    inquiry: Inquiry
    survey: Survey
    proposal: Proposal | None


def diagnose(
    job: Job, twin: Twin, runs: Sequence[Run], *, holdout: Sequence[str] = (), without: Sequence[str] = ()
) -> Diagnosis:
    """The diagnosis of an experiment; `without` names effects that the library is to do without."""
    used = [run for run in runs if run.name not in holdout] or list(runs)
    bench = Bench(twin, used)
    inquiry = open_inquiry(bench, atoms_of(twin.actuators, without))
    found = survey(inquiry)
    best = found.fits[found.verdict.best]
    gap = gap_of(inquiry)
    word = "unknown" if found.strange else found.verdict.word
    causes = _causes(inquiry, found)
    result: dict[str, Any] = {
        "verdict": word,
        "gap": gap,
        "where": _where(inquiry, found, best),
        "causes": causes,
        "alternatives": _alternatives(inquiry, found) if word == "ambiguous" else [],
        "shrinkage": _shrinkage(twin, runs, holdout, inquiry, best),
        "next_experiment": None,
        "equivalent": [[_named(inquiry, i) for i in group] for group in classes(likeness(inquiry))],
    }
    if word != "unknown":  # noise is measured before causes are known, and no more can be noise than they leave
        floor = min(gap["noise_floor_um"], result["shrinkage"]["ceiling_rms_um"])
        gap["noise_floor_um"] = result["shrinkage"]["noise_floor_um"] = floor
    proposal = _next(inquiry, found, word, job)
    if proposal is not None:
        result["next_experiment"] = {
            "action": proposal.candidate.action,
            "separates": list(proposal.separates),
            "gain": round(proposal.gain, 4),
            "minutes": round(proposal.candidate.minutes, 1),
        }
    return Diagnosis(result, inquiry, found, proposal)


def _next(inquiry: Inquiry, found: Survey, word: str, job: Job) -> Proposal | None:
    """What separates the answer from its rivals: those that explain alike, or else those that are not yet excluded."""
    if word == "none":
        return None
    if found.strange:
        return explore(inquiry, found.left[found.strange].labels, job)
    best = found.verdict.best
    close = [best, *sorted(found.verdict.rivals, key=lambda j: -found.probability[j])[:RIVALS]]
    if len(close) == 1:
        close += [j for j in np.argsort(-found.probability) if j != best and found.probability[j] > 0.02][:3]
    p = found.probability[close]
    if found.verdict.rivals:
        p = np.maximum(p, 0.1 * p.max())  # alike by construction: their prior is no reason to leave them untested
    return propose(inquiry, [found.fits[j] for j in close], p / p.sum(), job)


# -- causes -----------------------------------------------------------------------------------------------------------


def _energies(inquiry: Inquiry, f: Fitted) -> list[float]:
    """White energy of each member's own signal."""
    A, out, at = total(f.grams).A, [], 0
    for i in f.members:
        index = list(inquiry.atoms.columns[i])
        theta = f.theta[at : at + len(index)]
        at += len(index)
        out.append(float(theta @ A[np.ix_(index, index)] @ theta))
    return out


def _causes(inquiry: Inquiry, found: Survey) -> list[dict[str, Any]]:
    best = found.fits[found.verdict.best]
    energy = _energies(inquiry, best)
    left = found.left[found.strange].energy if found.strange else 0.0
    whole = sum(energy) + left
    out: list[dict[str, Any]] = []
    causes = inquiry.causes(best.members, best.theta, best.extra)
    covariance = joint_covariance(inquiry, best) if best.members else np.zeros((0, 0))
    for j, i in enumerate(best.members):
        atom = inquiry.columns.atoms[i]
        out.append({
            "effect": atom.name,
            "target": atom.target,
            "probability": round(min(found.verdict.inclusion.get(i, 0.0), 1.0), 4),
            "share": round(energy[j] / whole, 4) if whole > 0 else 0.0,
            "parameters": _parameters(inquiry, best, covariance, j, causes[j]),
        })  # fmt: skip
    out.sort(key=lambda c: (-c["probability"], -c["share"]))
    if found.strange:
        shares = rest_by_actuator(inquiry, best, found.strange)
        target = next((name for name, share in shares.items() if share > MOST), None)
        out.append({
            "effect": "unknown", "target": target, "probability": 1.0,
            "share": round(left / whole, 4) if whole > 0 else 1.0, "parameters": {},
        })  # fmt: skip
    return out


def _parameters(inquiry: Inquiry, f: Fitted, covariance: Floats, j: int, cause: Cause) -> dict[str, Any]:
    """Values with 95 % intervals; those of derived values follow the slopes of what they are derived from."""
    idle = _idle_shapes(inquiry, cause)
    kinds = {p.name: p for p in cause.effect.PARAMETERS}
    d = len(f.theta)
    shapes = inquiry.shapes_of(f.members)

    def at(step: Floats) -> dict[str, float]:
        extra = {i: dict(values) for i, values in f.extra.items()}
        for (i, p), change in zip(shapes, step[d:], strict=True):
            extra[i][p.name] += change
        values = inquiry.causes(f.members, f.theta + step[:d], extra)[j].values
        return {name: float(np.log(value)) if kinds[name].log else value for name, value in values.items()}

    # small steps inwards: a parameter on its bound still has a slope
    steps = 1e-3 * np.sqrt(np.diag(covariance)) * np.concatenate([np.where(f.theta < 0, -1.0, 1.0), np.ones(len(shapes))])
    here, out = at(np.zeros(len(steps))), {}
    moved = [at(row) for row in np.diag(steps)]
    for name, value in cause.values.items():
        if name in idle:
            continue
        change = np.array([each[name] - here[name] for each in moved])
        if name == "phase_rad":
            change = np.angle(np.exp(1j * change))
        slope = change / steps
        half = 1.96 * float(np.sqrt(slope @ covariance @ slope))
        ends = [here[name] - half, here[name] + half]
        low, high = np.exp(ends) if kinds[name].log else ends
        if name != "phase_rad":
            low, high = max(low, kinds[name].low), min(high, kinds[name].high)
        out[name] = {"value": _round(value), "ci95": [_round(low), _round(high)]}
    return out


def _idle_shapes(inquiry: Inquiry, cause: Cause) -> set[str]:
    """Scanned parameters that nothing depends on here: a warm-up time where temperatures are logged."""
    logged = all(run.course.temperature is not None for run in inquiry.bench.runs)
    return {p.name for p in cause.effect.PARAMETERS if p.scan and p.unit == "s"} if logged else set()


def _round(value: float) -> float:
    return float(f"{value:.6g}")


def _alternatives(inquiry: Inquiry, found: Survey) -> list[list[dict[str, Any]]]:
    sets = [found.fits[found.verdict.best], *(found.fits[j] for j in found.verdict.rivals)]
    return [[_named(inquiry, i) for i in f.members] for f in sets]


def _named(inquiry: Inquiry, i: int) -> dict[str, Any]:
    return {"effect": inquiry.columns.atoms[i].name, "target": inquiry.columns.atoms[i].target}


# -- where ------------------------------------------------------------------------------------------------------------


def _where(inquiry: Inquiry, found: Survey, best: Fitted) -> dict[str, Any]:
    gaps = run_gaps(inquiry)
    at = where.axes(gaps, channel_axes(inquiry))
    return {
        "stage": _stage(inquiry, best, found),
        "axes": {axis: at.get(axis, 0.0) for axis in "xyz"},
        "actuators": where.actuators(gaps, inquiry.bench.actuators),
        "lines": where.lines(gaps),
        "intervals": where.intervals(gaps),
        "drivers": _drivers(inquiry, found),
        **patterns_of(inquiry, gaps),
    }


def _stage(inquiry: Inquiry, best: Fitted, found: Survey) -> str:
    """The stage of the largest cause; of an unknown one, the stage of the channel that shows it."""
    energy = _energies(inquiry, best)
    left = found.left[found.strange].energy if found.strange else 0.0
    if found.strange and left > max(energy, default=0.0):
        stage = {"encoder": "control", "dyno": "process"}.get(found.strange)
        return stage or ("structure" if _first_label(found).startswith("force") else "drive")
    if energy:
        return str(inquiry.columns.atoms[best.members[int(np.argmax(energy))]].effect.STAGE)
    parts = {"control": slice(3, 3 + len(inquiry.bench.actuators)), "structure": slice(0, 3)}
    size = {}
    for name, part in parts.items():
        white = [np.nanmean((r[:, part] / inquiry.noise.sigma[k, part]) ** 2) for k, r in enumerate(inquiry.residuals)
                 if np.isfinite(r[:, part]).any()]  # fmt: skip
        size[name] = float(np.mean(white)) if white else 0.0
    return max(size, key=lambda each: size[each])


def _first_label(found: Survey) -> str:
    labels = found.left[found.strange].labels if found.strange else ()
    return labels[0][0] if labels else ""


def _drivers(inquiry: Inquiry, found: Survey) -> list[dict[str, Any]]:
    """What the gap depends on; with an unknown cause, what the rest depends on."""
    if found.strange:
        labels = found.left[found.strange].labels
    else:
        null = inquiry.refit(())
        at_null = leftovers(inquiry, null, firm_prior(inquiry))
        labels = max(at_null.values(), key=lambda each: each.energy).labels if at_null else ()
    return [{"covariate": name, "share": round(share, 4)} for name, share in labels[:6] if share > 0.02]


# -- shrinkage --------------------------------------------------------------------------------------------------------


def _shrinkage(twin: Twin, runs: Sequence[Run], holdout: Sequence[str], inquiry: Inquiry, best: Fitted) -> dict[str, Any]:
    """Named runs are judged with the fit of the others; without names every run is held out once."""
    if holdout:
        seen = Bench(twin, [run for run in runs if run.name in holdout])
        thetas = [best.theta] * len(seen.runs)
    else:
        seen = inquiry.bench
        thetas = [_theta_without(inquiry, best, k) for k in range(len(seen.runs))]
    floor = gap_of(inquiry)["noise_floor_um"]
    return shrinkage_of(inquiry, best, seen, thetas, _by_energy(inquiry, best), main_channels(inquiry), floor)


def _by_energy(inquiry: Inquiry, f: Fitted) -> list[int]:
    return list(np.argsort([-e for e in _energies(inquiry, f)]))


def _theta_without(inquiry: Inquiry, f: Fitted, k: int) -> Floats:
    """The members' coordinates fitted without run k, about the fit to all runs."""
    if len(f.grams) == 1 or not f.members:
        return f.theta
    index = inquiry.member_columns(f.members)
    rest = total(f.grams) - f.grams[k]
    return inquiry._bounded(f.members, estimate(rest, inquiry.prior, index, f.factor)[0][index])
