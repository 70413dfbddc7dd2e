"""A law or map that was found, in the result's words: formula, terms with units and intervals, envelope, what it cannot be
told from, and the entries of a machine file that put it to work.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

import numpy as np

from camcomp.diagnosis.law.bench_terms import AXES, OF_ACTUATORS, Spot, TermBench, TermRows
from camcomp.diagnosis.law.find import FoundLaw, strengths
from camcomp.diagnosis.law.forms import Form, SmoothForm
from camcomp.diagnosis.law.words import law_sentence, law_sum, listed
from camcomp.diagnosis.result.types import Law, LawPart, LawTerm, Stage, six_digits
from camcomp.ground.datatypes import Floats
from camcomp.model.law.expression import parse


def law_result(bench: TermRows, found: FoundLaw, before_um: float, after_um: float) -> Law:
    """The law as it stands in the result; before, after: rms of the gap on runs that it was not fitted to."""
    parts, terms = (_map_parts if found.is_map else _formula_parts)(bench, found)
    forms = [t.form for t in found.terms]
    alike = dict.fromkeys(f"{bench.where(o.spot)}: {_said(o.form)}" for each in found.alike for o in each)
    if found.is_map:
        about = dict.fromkeys(name for each in forms for name in each.about)
        says = f"No short law fits; a smooth map over {listed(list(about))} does."
    else:
        says = law_sentence([each for each in forms if isinstance(each, Form)])
    if alike:
        says += f" These data cannot tell it from {listed(list(alike)[:3])}."
    formula = "; ".join(f"{bench.where(spot)} = {each.formula or _over(each.over)}" for spot, each in parts)
    envelope = {name: limits for _, each in parts for name, limits in each.envelope.items()}
    return Law(
        formula=formula, on=_stage(bench, found), terms=tuple(terms), envelope=envelope, after_rms_um=round(after_um, 3),
        kind="map" if found.is_map else "formula", before_rms_um=round(before_um, 3), says=says, alike=tuple(alike),
        parts=tuple(each for spot, each in parts if spot.on != "force"),  # no machine file has forces
    )  # fmt: skip


def _stage(bench: TermRows, found: FoundLaw) -> Stage:
    """The stage of the spot whose terms move the tip most; one step of several axes at once is the workpiece's."""
    energy: dict[Spot, float] = {}
    for term, size in zip(found.terms, strengths(bench, found), strict=True):
        energy[term.spot] = energy.get(term.spot, 0.0) + size
    on = found.terms[0].spot.on if found.is_map else max(energy, key=energy.__getitem__).on
    steps = {t.spot.index for t in found.terms if t.form.family == "step"}
    if on == "structure" and len(steps) > 1:
        return "workpiece"
    return "control" if on == "control" else "drive" if on in OF_ACTUATORS else "structure"


def _formula_parts(bench: TermRows, found: FoundLaw) -> tuple[list[tuple[Spot, LawPart]], list[LawTerm]]:
    pairs: dict[Spot, list[tuple[float, str]]] = {}
    terms = []
    each = zip(found.by_term(found.theta), found.by_term(np.sqrt(np.diag(found.covariance))), found.terms, strict=True)
    for theta, sd, term in each:
        assert isinstance(term.form, Form)
        for value, s, text, unit in zip(theta, 1.96 * sd, term.form.said, term.form.units, strict=True):
            pairs.setdefault(term.spot, []).append((float(value), _tidy(text)))
            terms.append(_term(bench, term.spot, _tidy(text), value, (value - s, value + s), per=unit))
    parts = []
    for spot, own in pairs.items():
        formula = law_sum(own)
        names = parse(formula, dict.fromkeys(bench.rows(spot)[0])).names
        own_envelope = _envelope(bench, spot, names)
        parts.append((spot, LawPart(effect="formula", formula=formula, envelope=own_envelope, **_at(bench, spot))))
    return parts, terms


def _map_parts(bench: TermRows, found: FoundLaw) -> tuple[list[tuple[Spot, LawPart]], list[LawTerm]]:
    parts, terms = [], []
    for term, theta in zip(found.terms, found.by_term(found.theta), strict=True):
        assert isinstance(term.form, SmoothForm)
        coefficients = np.round(theta.reshape(term.form.counts), 7).tolist()
        limits = zip(term.form.about, term.form.limits, strict=True)
        envelope = {name: (six_digits(low), six_digits(high)) for name, (low, high) in limits}
        part = LawPart(
            effect="map", over=term.form.about, coefficients_mm=coefficients, envelope=envelope, **_at(bench, term.spot)
        )
        parts.append((term.spot, part))
        ends = theta.min(), theta.max()
        terms.append(_term(bench, term.spot, _over(term.form.about), max(map(abs, ends)), ends))
    return parts, terms


def _term(bench: TermRows, spot: Spot, text: str, value: float, ends: tuple[float, float], per: str = "") -> LawTerm:
    """A term with its coefficient and the ends of the interval; per: unit that the coefficient is divided by."""
    unit = bench.unit(spot)
    return LawTerm(
        term=f"{bench.where(spot)}: {text}", value=six_digits(value), ci95=(six_digits(ends[0]), six_digits(ends[1])),
        unit=f"{unit}/{per}" if per else unit,
    )  # fmt: skip


def _at(bench: TermRows, spot: Spot) -> dict[str, str | None]:
    if spot.on in OF_ACTUATORS:
        stage, target = "control" if spot.on == "control" else "drive", bench.actuators[spot.index]
        return {"stage": stage, "target": target, "axis": None}
    return {"stage": spot.on, "target": None, "axis": AXES[spot.index]}


def _envelope(bench: TermRows, spot: Spot, names: Iterable[str]) -> dict[str, tuple[float, float]]:
    size = bench.sizes(spot)
    out = {}
    for name in names:
        low, high = size.limits[name]
        if high > low:
            out[name] = (six_digits(low), six_digits(high))
    return out


def _tidy(text: str) -> str:
    """Without double signs."""
    return re.sub(r"([-+]) -(\d)", lambda m: ("+ " if m[1] == "-" else "- ") + m[2], text)


def _said(form: Form | SmoothForm) -> str:
    return " and ".join(_tidy(each) for each in form.said) if isinstance(form, Form) else _over(form.about)


def where_of(part: LawPart) -> str:
    """Tip and axis, or stage and target, of a part."""
    return f"tip {part.axis}" if part.axis else f"{part.stage} {part.target}"


def _over(about: Sequence[str] | None) -> str:
    return f"map over {listed(about or ())}"


def moved_without(bench: TermBench, found: FoundLaw) -> list[Floats]:
    """Tip motion (n, 3) mm in every run by the law fitted to the other parts."""
    out = [np.zeros((len(t), 3)) for t in bench.noise.time]
    for term, theta in zip(found.terms, found.by_term(found.theta_without), strict=True):
        for k, moved in enumerate(bench.moves(term.spot, bench.values(term.spot, term.form))):
            time, split = bench.noise.time[k], found.folds.split
            place = (time - time[0]) / max(float(time[-1] - time[0]), 1e-12)
            out[k] += np.einsum("nic,nc->ni", moved, theta[k * split.parts + split.of(place)])
    return out
