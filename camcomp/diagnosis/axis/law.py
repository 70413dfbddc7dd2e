"""Which law does the residual of an axis follow: the search of every law (`camcomp.diagnosis.law`) on the channels of an axis.

The drive force shows it over the encoder, in N. Where the following error shows the same over the set-points, that part
is in mm and can be put into a machine file.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from camcomp.diagnosis.axis.findings import AxisChannel
from camcomp.diagnosis.axis.noise_floor import log_gain, noise_of
from camcomp.diagnosis.axis.terms import AxisTravel, ripple
from camcomp.diagnosis.law.bench_terms import Spot, Term, TermRows
from camcomp.diagnosis.law.describe import law_result
from camcomp.diagnosis.law.find import BETTER, FoundLaw, find_law, fitted, strengths
from camcomp.diagnosis.law.forms import HARD_MM, Form, at_drive
from camcomp.diagnosis.law.screen import grids_of
from camcomp.diagnosis.law.shapes import Shapes
from camcomp.diagnosis.model.noise import MINOR
from camcomp.diagnosis.result.types import Law
from camcomp.diagnosis.statistics.by_channel import ByChannel
from camcomp.diagnosis.statistics.folds import Folds, RunColumns, Split, usual_split
from camcomp.diagnosis.statistics.probability import EQUAL_LOG_ODDS
from camcomp.ground.datatypes import Floats
from camcomp.model.law.covariates import REFERENCE_C

WAVES = ("sin(2*pi*act_mm/{0})", "cos(2*pi*act_mm/{0})")
ONE_WAY = (f"max(way(act_mm, {HARD_MM}), 0)", f"max(-way(act_mm, {HARD_MM}), 0)")
FIXED = 1e6  # of what the rows tell of a size: it stays
FIT_AGAIN = 2  # searches: the noise of the first one has the law in it


class AxisRows(TermRows):
    """Residuals of one channel of an axis: of a drive force, N, or of an encoder, mm.

    left: residuals (n,) per run. noise: standard deviation of a row that counts as one of its own. held: whether the causes
    keep their sizes beside a law, as in a machine file that it is written to.
    """

    def __init__(
        self, name: str, channel: AxisChannel, moves: Sequence[AxisTravel], *, force: bool, held: bool = False
    ) -> None:
        self.spot, self.moves = Spot("force" if force else "control", 0), moves
        self.left = [each if force else -each for each in channel.left]  # set-point minus encoder is what is studied
        self.floor, self.wide = channel.floor, float(np.sqrt(np.mean(channel.rows**2)))
        self.actuators, self.row_counts = (name,), [len(each) for each in self.left]
        self.noise = noise_of(np.concatenate(self.left), channel.floor)
        size = np.sqrt(np.mean(channel.columns**2, axis=0)) + 1e-300
        self._taken, self._held = np.linalg.qr(channel.columns / size)[0], held
        self._base = np.split(channel.columns / size, np.cumsum(self.row_counts)[:-1])

    def unit(self, spot: Spot) -> str:
        """Of the channel."""
        return "N" if spot.on == "force" else "mm"

    def rows(self, spot: Spot) -> Sequence[Mapping[str, Floats]]:
        """Covariates per run."""
        return [
            {
                "act_mm": m.position, "act_mm_per_s": m.speed, "act_mm_per_s2": m.acceleration, "common_s": m.time,
                "temp_C": np.full(len(m.time), REFERENCE_C), "cut_min": np.zeros(len(m.time)),
            }
            for m in self.moves
        ]  # fmt: skip

    def rms(self, spot: Spot, values: Sequence[Floats]) -> Floats:
        """Size (f,) of functions (n, f) over all rows across the columns that were fitted."""
        X = np.concatenate(values)
        return np.asarray(np.sqrt(np.mean((X - self._taken @ (self._taken.T @ X)) ** 2, axis=0)))

    def white(self, spot: Spot, values: Sequence[Floats]) -> RunColumns:
        """Functions (n, f) per run over the noise."""
        return [ByChannel(v.shape[1], ((np.arange(v.shape[1]), v / self.noise),)) for v in values]

    def folds(self, split: Split) -> Folds:
        """Residuals with the columns that were fitted, each of them as large as the channel at most."""
        every, least = np.arange(self._base[0].shape[1]), sum(self.row_counts) / self.noise**2
        return Folds(
            white=[ByChannel(len(every), ((every, X / self.noise),)) for X in self._base],
            residual=[each / self.noise for each in self.left],
            precision=np.full(len(every), FIXED * least if self._held else self.wide**-2), split=split, constants=[],
            places=[(m.time - m.time[0]) / max(float(np.ptp(m.time)), 1e-12) for m in self.moves],
        )  # fmt: skip

    def gain_of(self, form: Form, left: Sequence[Floats]) -> float:
        """Log Bayes factor of a form for residuals (n,) per run."""
        more = np.concatenate(self.values(self.spot, form))
        return log_gain(np.concatenate(left), np.concatenate(self._base), more, self.floor)

    def left_with(self, found: FoundLaw) -> list[Floats]:
        """Residuals (n,) per run with a law, each row by a fit to the other parts."""
        folds, out = found.folds, []
        base = folds.means(found.columns, found.precision)
        for k, m in enumerate(self.moves):
            part = 1 + k * folds.split.parts + folds.split.of((m.time - m.time[0]) / max(float(np.ptp(m.time)), 1e-12))
            X = self.noise * ByChannel.joined([each[k] for each in found.columns]).parts[0][1]
            own = np.einsum("nc,nc->n", X, found.theta_without[part - 1])
            out.append(self.left[k] - own - np.einsum("nk,nk->n", self._base[k], base[part]))
        return out


def axis_law(
    name: str, force: AxisChannel | None, following: AxisChannel | None, asked: Sequence[AxisTravel]
) -> Law | None:
    """The law of the residuals of an axis; asked: the travel of its set-points, per run of the following error."""
    own = force or following
    if own is None:
        return None
    rows = AxisRows(name, own, [r.move for r in force.fitted] if force else asked, force=force is not None)
    found = _found(rows)
    if found is None:
        return None
    law = law_result(rows, found, *_sizes_um(rows, found))
    second = _written(name, following, asked, found) if following is not None else None
    if force is None:
        return second
    before, after = (1e-3 * each for each in (law.before_rms_um, law.after_rms_um))
    says = f"{law.says} The drive force of {name} goes from {before:.3g} N to {after:.3g} N (rms)."
    if second is None:  # the gap itself does not show it
        if following is None:
            return law.model_copy(update={"says": says})
        size = round(1e3 * float(np.sqrt(np.mean(np.concatenate(following.left) ** 2))), 3)
        return law.model_copy(update={"says": says, "before_rms_um": size, "after_rms_um": size})
    return second.model_copy(
        update={
            "formula": f"{law.formula}; {second.formula}", "on": law.on, "terms": (*law.terms, *second.terms),
            "envelope": law.envelope | second.envelope, "says": says,
        }
    )  # fmt: skip


def _written(name: str, following: AxisChannel, asked: Sequence[AxisTravel], found: FoundLaw) -> Law | None:
    """The terms of a law, fitted to a following error whose causes stay as they are; None where it does not show them."""
    rows = AxisRows(name, following, asked, force=False, held=True)
    same = fitted(Shapes(rows), [Term(rows.spot, t.form) for t in found.terms], rows.folds(usual_split(len(asked))))
    before, after = _sizes_um(rows, same)
    return None if after > BETTER * before else law_result(rows, same, before, after)


def _found(rows: AxisRows) -> FoundLaw | None:
    """The law of a channel; None where it is as small as on healthy machines."""
    found = None
    waves = dict.fromkeys(_waves(rows, rows.left))
    for _ in range(FIT_AGAIN):
        some = at_drive(rows.sizes(rows.spot), False)
        forms = [f for f in some if f.family != "wave" and f.about != ("common_s",)]
        if not forms and not waves:  # an axis that stands
            return None
        grids = grids_of([((rows.spot,), [*forms, *waves])])
        found = find_law(rows, lambda split, _: rows.folds(split), grids, rows.floor)
        if found is None:
            return None
        left = rows.left_with(found)
        rows.noise = noise_of(np.concatenate(left), rows.floor)
        waves |= dict.fromkeys(_waves(rows, left))
    size = float(np.sqrt(sum(strengths(rows, found)))) if found else 0.0
    return found if size > MINOR * rows.floor else None


def _waves(rows: AxisRows, left: Sequence[Floats]) -> list[Form]:
    """The strongest period of residuals over the travel: in common for both directions, or separate where that says clearly more."""
    line = ripple(list(rows.moves), list(left), np.ones((sum(map(len, left)), 1)))
    if line is None:
        return []
    one = Form(
        family="wave", about=("act_mm",), texts=WAVES, units=("", ""), shape=(float(line.period),),
        bounds=((0.99 * line.period, 1.01 * line.period),),
    )  # fmt: skip
    apart = tuple(f"{text}*{way}" for way in ONE_WAY for text in WAVES)
    each = replace(one, texts=apart, units=("",) * len(apart))
    gains = [rows.gain_of(form, left) for form in (one, each)]
    return [each if gains[1] > gains[0] + EQUAL_LOG_ODDS else one]


def _sizes_um(rows: AxisRows, found: FoundLaw) -> tuple[float, float]:
    """Rms of the residual without and with a law, um or mN."""
    both = (np.concatenate(each) for each in (rows.left, rows.left_with(found)))
    before, after = (round(1e3 * float(np.sqrt(np.mean(each**2))), 3) for each in both)
    return before, after
