"""A proposed experiment, its value, and the interpretation of each of its outcomes, a sentence each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from camcomp.diagnosis.law.words import listed
from camcomp.diagnosis.model.classes import INDISTINGUISHABLE, MOST_SETS
from camcomp.diagnosis.next_experiment.candidates import Candidate
from camcomp.diagnosis.next_experiment.design import SETUP_MIN
from camcomp.diagnosis.next_experiment.information_gain import ExpectedGain
from camcomp.diagnosis.next_experiment.predicted_logs import ONLY_NOISE
from camcomp.report.plot import brief

_WHAT = {
    "tip": ("the tip is", 1e3, "µm"),
    "encoder": ("the encoders are", 1e3, "µm"),
    "drive": ("the drive forces are", 1.0, "N"),
    "dyno": ("the cutting force is", 1.0, "N"),
}
NEITHER = "If what is left stays above the noise whichever it is, something unknown is at work as well."
PRICE = 0.5 / 60.0  # bits per minute of machine time
LEAST_BITS = PRICE * SETUP_MIN  # an experiment has to tell more than it costs to set one up


@dataclass(frozen=True, eq=False, kw_only=True)
class Proposal:
    """An experiment, its expected information (bits), the effects that it separates, and what each outcome would mean."""

    candidate: Candidate
    gain: float
    separates: tuple[str, ...]
    outcomes: tuple[str, ...]

    @property
    def value(self) -> float:
        """Bits minus the price of the machine time."""
        return self.gain - PRICE * self.candidate.minutes


def outcomes_of(found: ExpectedGain, candidate: Candidate, names: Sequence[str]) -> tuple[str, ...]:
    """What each outcome of a candidate would mean; names: of the rival sets of causes, in their order."""
    if len(names) == 1:
        return (
            (
                f"If no more than the noise is left on it with {names[0]} in the model, that holds; what stays uncertain then moves the tip by "
                f"{_um(found.after_um)} (rms) on the runs' programs instead of {_um(found.before_um)}."
            ),
            "If more is left, something acts there that these runs did not show.",
        )
    if candidate.knows:
        [(effect, *_)] = candidate.knows
        return (*(_by_hand(name, effect) for name in names[:MOST_SETS]), NEITHER)
    return (*(_by_log(found, names, i) for i in range(min(len(names), MOST_SETS))), NEITHER)


def _by_hand(name: str, effect: str) -> str:
    if effect in name:
        return f"If it is off by what {name} says, that is the cause, and with it in the config the gap is gone."
    return f"If it is as the machine file states, and the gap stays with --without {effect}, the cause is {name}."


def _by_log(found: ExpectedGain, names: Sequence[str], i: int) -> str:
    if names[i] == ONLY_NOISE:
        return "If nothing but noise is left on it, there is no cause."
    what, scale, unit = _WHAT[found.kind]
    off = f"If it is {names[i]}, {what} off by {brief(scale * float(found.shows[i]), 2)} {unit} (rms) on it"
    others = [j for j in range(len(names)) if j != i]
    if alike := [names[j] for j in others if found.apart[i, j] < INDISTINGUISHABLE]:
        return f"{off}; {listed(alike[:MOST_SETS])} would look the same there."
    left, nearest = min((float(found.left[i, j]), j) for j in others)
    return f"{off}, of which {names[nearest]} cannot explain {brief(scale * left, 2)} {unit}."


def after_unknown(varies: Sequence[str], others: Sequence[str]) -> tuple[str, ...]:
    """Outcomes for an unknown effect; varies: changed covariates, others: unchanged covariates of the residual."""
    changed, stays = " and ".join(varies), " or ".join(others[:MOST_SETS])
    return (
        f"If what is left changes, it goes with {changed}.",
        f"If it stays as it is, it does not go with {changed}" + (f" but with {stays}." if stays else "."),
    )


def _um(value: float) -> str:
    return f"{brief(value, 2)} µm"
