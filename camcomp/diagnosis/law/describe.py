"""A law or map that was found, in the result's words: formula, terms with units and intervals, envelope, what it cannot be
told from, and the entries of a machine file that put it to work.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

import numpy as np

from camcomp.diagnosis.law.bench_terms import Spot, TermBench
from camcomp.diagnosis.law.find import FoundLaw
from camcomp.diagnosis.law.forms import Form
from camcomp.diagnosis.law.smooth import FoundMap
from camcomp.diagnosis.law.words import law_sentence, law_sum, listed
from camcomp.diagnosis.result.types import Law, LawPart, LawTerm, Stage
from camcomp.ground.datatypes import Floats, Ints
from camcomp.model.law.expression import parse

_AXES = "xyz"


def law_result(bench: TermBench, found: FoundLaw | FoundMap, before_um: float, after_um: float) -> Law:
    """The law as it stands in the result; before, after: rms of the gap on runs that it was not fitted to."""
    actuators = bench.bench.actuators
    if isinstance(found, FoundMap):
        parts, terms, about = _map_parts(bench, found, actuators)
        first, kind = found.maps[0].spot, "map"
        says = f"No short law fits; a smooth map over {listed(about)} does."
        alike: tuple[str, ...] = ()
    else:
        parts, terms = _formula_parts(bench, found, actuators)
        first, kind = _strongest(bench, found), "formula"
        says = law_sentence([t.form for t in found.terms])
        alike = tuple(
            dict.fromkeys(f"{_where(o.spot, actuators)}: {_said(o.form)}" for each in found.alike for o in each)
        )
        if alike:
            says += f" These data cannot tell it from {listed(alike[:3])}."
    on: Stage = _stage(first, found)
    formula = "; ".join(f"{_where_of(each)} = {_equation(each)}" for each in parts)
    envelope = {name: limits for each in parts for name, limits in each.envelope.items()}
    return Law(
        formula=formula, on=on, terms=tuple(terms), envelope=envelope, after_rms_um=round(after_um, 3), kind=kind,
        before_rms_um=round(before_um, 3), says=says, alike=alike, parts=tuple(parts),
    )  # fmt: skip


def _stage(spot: Spot, found: FoundLaw | FoundMap) -> Stage:
    """The stage that a law is said to act on: one step of several axes at once is the workpiece's."""
    if isinstance(found, FoundLaw) and spot.on == "structure":
        steps = {t.spot.index for t in found.terms if t.form.family == "step"}
        if len(steps) > 1:
            return "workpiece"
    return "control" if spot.on == "control" else "drive" if spot.on == "drive" else "structure"


def _strongest(bench: TermBench, found: FoundLaw) -> Spot:
    """The spot whose terms move the tip most."""
    energy: dict[Spot, float] = {}
    at = 0
    for term in found.terms:
        moved = bench.moves(term.spot, bench.values(term.spot, term.form))
        own = found.theta[at : at + len(term.form.texts)]
        energy[term.spot] = energy.get(term.spot, 0.0) + sum(float(np.sum((m @ own) ** 2)) for m in moved)
        at += len(term.form.texts)
    return max(energy, key=lambda each: energy[each])


def _formula_parts(bench: TermBench, found: FoundLaw, actuators: Sequence[str]) -> tuple[list[LawPart], list[LawTerm]]:
    sd = np.sqrt(np.diag(found.covariance))
    texts: dict[Spot, list[tuple[float, str]]] = {}
    about: dict[Spot, list[str]] = {}
    terms, at = [], 0
    for term in found.terms:
        for text, unit in zip(term.form.said, term.form.units, strict=True):
            value, half = float(found.theta[at]), 1.96 * float(sd[at])
            texts.setdefault(term.spot, []).append((value, _tidy(text)))
            about.setdefault(term.spot, []).extend(term.form.about)
            terms.append(
                LawTerm(
                    term=f"{_where(term.spot, actuators)}: {_tidy(text)}", value=_round(value),
                    ci95=(_round(value - half), _round(value + half)), unit=_unit(bench, term.spot, unit),
                )
            )  # fmt: skip
            at += 1
    parts = []
    for spot, pairs in texts.items():
        formula = law_sum(pairs)
        names = parse(formula, dict.fromkeys(bench.rows(spot)[0])).names
        parts.append(
            LawPart(effect="formula", formula=formula, envelope=_envelope(bench, spot, names), **_at(spot, actuators))
        )
    return parts, terms


def _map_parts(
    bench: TermBench, found: FoundMap, actuators: Sequence[str]
) -> tuple[list[LawPart], list[LawTerm], list[str]]:
    parts, terms, at = [], [], 0
    for term in found.maps:
        count = int(np.prod(term.shape))
        own, at = found.theta[at : at + count].reshape(term.shape), at + count
        envelope = {
            name: (_round(low), _round(high)) for name, (low, high) in zip(term.names, term.limits, strict=True)
        }
        coefficients = np.round(own, 7).tolist()
        parts.append(
            LawPart(
                effect="map",
                over=term.names,
                coefficients_mm=coefficients,
                envelope=envelope,
                **_at(term.spot, actuators),
            )
        )
        most = float(np.abs(own).max())
        low, high = float(own.min()), float(own.max())
        terms.append(
            LawTerm(
                term=f"{_where(term.spot, actuators)}: map over {listed(term.names)}", value=_round(most),
                ci95=(_round(low), _round(high)), unit=_unit(bench, term.spot, ""),
            )
        )  # fmt: skip
    return parts, terms, list(dict.fromkeys(name for each in found.maps for name in each.names))


def _at(spot: Spot, actuators: Sequence[str]) -> dict[str, str | None]:
    if spot.on in ("control", "drive"):
        return {"stage": spot.on, "target": actuators[spot.index], "axis": None}
    return {"stage": spot.on, "target": None, "axis": _AXES[spot.index]}


def _envelope(bench: TermBench, spot: Spot, names: Iterable[str]) -> dict[str, tuple[float, float]]:
    size = bench.sizes(spot)
    out = {}
    for name in names:
        low, high = size.limits[name]
        if high > low:
            out[name] = (_round(low), _round(high))
    return out


def _tidy(text: str) -> str:
    """Without double signs."""
    return re.sub(r"([-+]) -(\d)", lambda m: ("+ " if m[1] == "-" else "- ") + m[2], text)


def _said(form: Form) -> str:
    return " and ".join(_tidy(each) for each in form.said)


def _where(spot: Spot, actuators: Sequence[str]) -> str:
    if spot.on in ("control", "drive"):
        return f"{spot.on} {actuators[spot.index]}"
    return f"tip {_AXES[spot.index]}"


def _where_of(part: LawPart) -> str:
    return f"tip {part.axis}" if part.axis else f"{part.stage} {part.target}"


def _equation(part: LawPart) -> str:
    return part.formula or f"map over {listed(part.over or ())}"


def _unit(bench: TermBench, spot: Spot, per: str) -> str:
    hinge = spot.on in ("control", "drive") and bench.bench.twin.robot.actuators[spot.index].revolute
    own = "rad" if hinge else "mm"
    return f"{own}/{per}" if per else own


def _round(value: float) -> float:
    return float(f"{value:.6g}")


def moved_without(
    bench: TermBench, found: FoundLaw | FoundMap, terms: Sequence[tuple[Spot, list[Floats]]]
) -> list[Floats]:
    """Tip motion (n, 3) mm in every run by the law fitted to the other parts; terms: spots with their functions."""
    out = [np.zeros((len(t), 3)) for t in bench.times]
    at = 0
    for spot, values in terms:
        count = values[0].shape[1]
        for k, moved in enumerate(bench.moves(spot, values)):
            theta = found.theta_without[_part_of_rows(found, bench.times[k], k)][:, at : at + count]
            out[k] = out[k] + np.einsum("nic,nc->ni", moved, theta)
        at += count
    return out


def _part_of_rows(found: FoundLaw | FoundMap, time: Floats, k: int) -> Ints:
    """Which part every row (n,) of run k belongs to."""
    place = (time - time[0]) / max(float(time[-1] - time[0]), 1e-12)
    return k * found.folds.split.parts + found.folds.split.of(place)


def terms_of(
    bench: TermBench, found: FoundLaw | FoundMap, map_values: Sequence[list[Floats]] = ()
) -> list[tuple[Spot, list[Floats]]]:
    """Spots with their functions (n, f) per run, in the order of theta."""
    if isinstance(found, FoundMap):
        return [(each.spot, values) for each, values in zip(found.maps, map_values, strict=True)]
    return [(term.spot, bench.values(term.spot, term.form)) for term in found.terms]
