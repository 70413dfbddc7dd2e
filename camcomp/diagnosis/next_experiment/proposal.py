"""A proposed experiment and its value."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from camcomp.diagnosis.next_experiment.candidates import Candidate

if TYPE_CHECKING:
    from camcomp.diagnosis.next_experiment.information_gain import ExpectedGain

WORTH = 0.1  # bits below which an experiment is not worth proposing
PRICE = 0.5 / 60.0  # bits per minute of machine time


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
    def value(self) -> float:
        """Bits minus the price of the machine time."""
        return self.gain - PRICE * self.candidate.minutes
