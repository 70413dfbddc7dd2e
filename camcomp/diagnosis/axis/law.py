"""Which law does the residual of an axis follow: the forms of drives over its travel, added one by one while withheld
stretches gain.

The drive force shows it over the encoder, in N. Where the following error shows the same over the set-points, that part
is in mm and can be put into a machine file.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

from camcomp.diagnosis.axis.block_least_squares import (
    LEAST_Z,
    Gain,
    Series,
    fit,
    gain,
    held_out_residuals,
    log10_chance,
    solve,
    withheld,
)
from camcomp.diagnosis.axis.findings import AxisChannel
from camcomp.diagnosis.axis.terms import AxisTravel, ripple
from camcomp.diagnosis.law.forms import Form, at_drive, sizes
from camcomp.diagnosis.law.words import law_sentence, law_sum
from camcomp.diagnosis.model.noise import MINOR
from camcomp.diagnosis.result.types import Law, LawPart, LawTerm, six_digits
from camcomp.ground.datatypes import Floats
from camcomp.model.law.covariates import REFERENCE_C
from camcomp.model.law.expression import parse

LEAST_SHARE = 0.03  # of the rms of withheld stretches
FALSE_RATE = 0.02  # of a law where there is none
MOST_FORMS = 4
TRIED = 6  # kinds of forms that are tried on withheld stretches at every step
TURN_MM = 0.02  # way over which a reversal changes the sense
ONE_WAY = ("max(way(act_mm, {turn}), 0)", "max(-way(act_mm, {turn}), 0)")
LEFT = 1e-4  # of a column's energy beside the others, below which it says nothing of its own


@dataclass(frozen=True, eq=False)
class _Rows:
    """Covariates (n,) by name of all rows of a channel, and the base columns that are fitted jointly with a law."""

    data: Series
    base: Floats  # (n, k)
    known: Mapping[str, Floats]

    def columns(self, forms: Sequence[Form]) -> Floats:
        """Functions of forms (n, c)."""
        n = len(self.data.y)
        found = [parse(text, dict.fromkeys(self.known))(self.known, n) for each in forms for text in each.said]
        return np.nan_to_num(np.stack(found, axis=1)) if found else np.zeros((n, 0))

    def withheld(self, forms: Sequence[Form]) -> Floats:
        """Mean squares (blocks,) of the residuals of base and forms in blocks that were not fitted."""
        return withheld(self.data, np.concatenate([self.base, self.columns(forms)], axis=1))

    def rms(self, forms: Sequence[Form]) -> float:
        """Rms residual of a joint fit of base and forms to all rows."""
        left = held_out_residuals(self.data, np.concatenate([self.base, self.columns(forms)], axis=1))
        return float(np.sqrt(np.mean(left**2)))


def axis_law(
    name: str, force: AxisChannel | None, following: AxisChannel | None, told: Sequence[AxisTravel]
) -> Law | None:
    """The law of the residuals of an axis, mm; told: the travel of its set-points, per run of the following error."""
    own = [each for each in (force, following) if each is not None]
    if not own:
        return None
    first = _rows(own[0], own[0].moves if own[0] is force else told)
    forms = _chosen(first, own[0], own[0].moves if own[0] is force else told)
    if not forms:
        return None
    seen = [(own[0] is force, first)]
    if own[0] is force and following is not None:
        also = _rows(following, told)
        if _holds(gain(also.withheld([]), also.withheld(forms)), 1):
            seen.append((False, also))
    return _told(name, seen, forms, following)


def _rows(channel: AxisChannel, moves: Sequence[AxisTravel]) -> _Rows:
    return _Rows(channel.residual, channel.columns, _covariates(moves))


def _covariates(moves: Sequence[AxisTravel]) -> dict[str, Floats]:
    parts = [
        {"act_mm": m.position, "act_mm_per_s": m.speed, "act_mm_per_s2": m.acceleration, "common_s": m.time}
        for m in moves
    ]
    known = {key: np.concatenate([each[key] for each in parts]) for key in parts[0]}
    n = len(known["act_mm"])
    return {**known, "temp_C": np.full(n, REFERENCE_C), "cut_min": np.zeros(n)}


# -- choice -----------------------------------------------------------------------------------------------------------


def _chosen(rows: _Rows, channel: AxisChannel, moves: Sequence[AxisTravel]) -> list[Form]:
    """Forms that withheld stretches ask for, the strongest first."""
    chosen: list[Form] = []
    library = [f for f in at_drive(sizes([rows.known]), False) if f.family != "wave" and f.about != ("common_s",)]
    while len(chosen) < MOST_FORMS:
        waves, tried = _waves(rows, chosen, moves)
        before = rows.withheld(chosen)
        found = [(gain(before, rows.withheld([*chosen, each])), each) for each in _leaders(rows, chosen, library)]
        found = [(g, each) for g, each in found if _holds(g, len(library))]
        found += [(g, w) for w in waves if _holds(g := gain(before, rows.withheld([*chosen, w])), tried)]
        found = [(g, each) for g, each in found if _size(g, before) > MINOR * channel.floor]
        if not found:
            break
        chosen.append(max(found, key=lambda each: each[0].log_ratio)[1])
    return chosen


def _holds(g: Gain, tried: int) -> bool:
    return g.z > LEAST_Z and g.log_ratio > LEAST_SHARE and log10_chance(g, tried) < np.log10(FALSE_RATE)


def _size(g: Gain, before: Floats) -> float:
    """Rms that a form explains on withheld stretches."""
    return float(np.sqrt(max(1.0 - np.exp(-2.0 * g.log_ratio), 0.0) * np.mean(before)))


def _waves(rows: _Rows, chosen: Sequence[Form], moves: Sequence[AxisTravel]) -> tuple[list[Form], int]:
    """The strongest period over the travel, in common for both directions and separate for each, and the number of
    periods tried.
    """
    A = np.concatenate([rows.base, rows.columns(chosen)], axis=1)
    left = rows.data.y - A @ solve(A, rows.data.y)
    line = ripple(list(moves), np.split(left, np.cumsum([len(m.time) for m in moves])[:-1]))
    if line is None:
        return [], 1
    texts = ("sin(2*pi*act_mm/{0})", "cos(2*pi*act_mm/{0})")
    apart = tuple(f"{text}*{way.format(turn=TURN_MM)}" for way in ONE_WAY for text in texts)
    bounds = ((0.99 * line.period, 1.01 * line.period),)
    kinds = [
        Form(
            family="wave",
            about=("act_mm",),
            texts=each,
            units=("",) * len(each),
            shape=(float(line.period),),
            bounds=bounds,
        )
        for each in (texts, apart)
    ]
    return [_refined(rows, chosen, each) for each in kinds], line.tried


def _leaders(rows: _Rows, chosen: Sequence[Form], library: Sequence[Form]) -> list[Form]:
    """The form of every kind that explains most of all rows, with its shape refined."""
    left, clean = _beside(rows, chosen)
    X = rows.columns(library)
    own = np.einsum("nc,nc->c", X, X)
    X = clean(X)
    kept = np.einsum("nc,nc->c", X, X)
    explained = np.where(kept > LEFT * own + 1e-300, (left @ X) ** 2 / np.maximum(kept, 1e-300), 0.0)
    best: dict[str, Form] = {}
    for i in np.argsort(-explained):
        if explained[i] > LEAST_SHARE * float(left @ left) and len(best) < TRIED:
            best.setdefault(library[i].family, library[i])
    return [_refined(rows, chosen, each) for each in best.values()]


def _beside(rows: _Rows, chosen: Sequence[Form]) -> tuple[Floats, Callable[[Floats], Floats]]:
    """What base and chosen forms leave of the rows (n,), and what takes them out of other columns (n, c)."""
    A = np.concatenate([rows.base, rows.columns(chosen)], axis=1)
    Q = np.linalg.qr(A / (np.sqrt(np.mean(A**2, axis=0)) + 1e-300))[0]

    def clean(X: Floats) -> Floats:
        return np.asarray(X - Q @ (Q.T @ X))

    return clean(rows.data.y), clean


def _refined(rows: _Rows, chosen: Sequence[Form], form: Form) -> Form:
    """With the shape that explains most of all rows."""
    if not form.shape:
        return form
    left, clean = _beside(rows, chosen)
    start = np.array(form.shape)
    scale = np.array([0.05 * (high - low) for low, high in form.bounds])

    def cost(u: Floats) -> float:
        X = clean(rows.columns([form.at(start + scale * u)]))
        return float(np.sum((left - X @ np.linalg.lstsq(X, left, rcond=1e-9)[0]) ** 2) / np.sum(left**2))

    found = minimize(
        cost, np.zeros(len(start)), method="Nelder-Mead", options={"maxfev": 30, "xatol": 0.01, "fatol": 1e-5}
    )
    return form.at(start + scale * found.x)


# -- words ------------------------------------------------------------------------------------------------------------


def _told(name: str, seen: Sequence[tuple[bool, _Rows]], forms: Sequence[Form], following: AxisChannel | None) -> Law:
    """The law as it stands in the result; seen: whether it is the force, and its rows."""
    terms: list[LawTerm] = []
    formulas, parts, changes = list[str](), list[LawPart](), list[tuple[float, float]]()
    envelope: dict[str, tuple[float, float]] = {}
    for is_force, rows in seen:
        X = rows.columns(forms)
        c, C = fit(rows.data, np.concatenate([rows.base, X], axis=1))
        k = rows.base.shape[1]
        sign = 1.0 if is_force else -1.0  # set-point minus encoder is what is studied: a law moves the encoder
        value, half = sign * c[k:], 1.96 * np.sqrt(np.diag(C))[k:]
        texts = [text for each in forms for text in each.said]
        units = [unit for each in forms for unit in each.units]
        where = f"{'force' if is_force else 'control'} {name}"
        own = "N" if is_force else "mm"
        terms += [
            LawTerm(term=f"{where}: {t}", value=six_digits(v), ci95=(six_digits(v - h), six_digits(v + h)), unit=f"{own}/{u}" if u else own)
            for t, u, v, h in zip(texts, units, value, half, strict=True)
        ]  # fmt: skip
        formula = law_sum(list(zip([float(v) for v in value], texts, strict=True)))
        formulas.append(f"{where} = {formula}")
        before, after = rows.rms([]), rows.rms(forms)
        changes.append((before, after))
        own_envelope = {
            key: (six_digits(float(rows.known[key].min())), six_digits(float(rows.known[key].max())))
            for key in parse(formula, dict.fromkeys(rows.known)).names
        }
        envelope |= own_envelope
        if not is_force:
            parts.append(
                LawPart(
                    effect="formula", stage="control", target=name, axis=None, envelope=own_envelope, formula=formula
                )
            )
    says = law_sentence(forms)
    if seen[0][0]:
        says += f" The drive force of {name} goes from {changes[0][0]:.3g} N to {changes[0][1]:.3g} N (rms)."
    if following is not None and seen[-1][0]:  # the gap itself does not show it
        changes.append((float(np.sqrt(np.mean(following.last))),) * 2)
    before, after = changes[-1]
    return Law(
        formula="; ".join(formulas), on="drive" if seen[0][0] else "control", terms=tuple(terms), envelope=envelope,
        after_rms_um=round(1e3 * after, 3), before_rms_um=round(1e3 * before, 3), says=says, parts=tuple(parts),
    )  # fmt: skip
