"""A proposed experiment, its value, and the interpretation of each of its outcomes, a sentence each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from camcomp.diagnosis.law.words import listed
from camcomp.diagnosis.model.classes import INDISTINGUISHABLE, MOST_SETS
from camcomp.diagnosis.next_experiment.candidates import Candidate
from camcomp.diagnosis.next_experiment.design import SETUP_MIN
from camcomp.report.plot import brief

if TYPE_CHECKING:
    from camcomp.diagnosis.next_experiment.information_gain import ExpectedGain

ONLY_NOISE = "nothing but noise"  # the name of an empty set of causes
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
    """An experiment, the effects that it separates, its expected information; gain: bits. rivals: names of the sets."""

    candidate: Candidate
    gain: float
    separates: tuple[str, ...]
    outcomes: tuple[str, ...] = ()
    told: ExpectedGain | None = None
    rivals: tuple[str, ...] = ()

    @property
    def tells(self) -> bool:
        """Whether it tells more than it costs to set an experiment up."""
        return self.gain > LEAST_BITS

    @property
    def value(self) -> float:
        """Bits minus the price of the machine time."""
        return self.gain - PRICE * self.candidate.minutes


def with_outcomes(proposal: Proposal, names: Sequence[str]) -> Proposal:
    """The proposal with its outcomes; names: of the rival sets of causes, in their order."""
    found = proposal.told
    if found is None:
        return proposal
    if len(names) == 1:
        sentences = [
            (
                f"If no more than the noise is left on it with {names[0]} in the model, that holds; what stays uncertain then moves the tip by "
                f"{_um(found.after_um)} (rms) on the runs' programs instead of {_um(found.before_um)}."
            ),
            "If more is left, something acts there that these runs did not show.",
        ]
    elif proposal.candidate.knows:
        [(effect, *_)] = proposal.candidate.knows
        sentences = [_by_hand(name, effect) for name in names[:MOST_SETS]]
    else:
        sentences = [_by_log(proposal, names, i) for i in range(min(len(names), MOST_SETS))]
    if len(names) > 1:
        sentences.append(NEITHER)
    return replace(proposal, outcomes=tuple(sentences), rivals=tuple(names))


def _by_hand(name: str, effect: str) -> str:
    if effect in name:
        return f"If it is off by what {name} says, that is the cause, and with it in the config the gap is gone."
    return f"If it is as the machine file states, and the gap stays with --without {effect}, the cause is {name}."


def _by_log(proposal: Proposal, names: Sequence[str], i: int) -> str:
    found = proposal.told
    assert found is not None
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
