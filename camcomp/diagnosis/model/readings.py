"""Can a log be what its columns say? Where another unit, order or sign of them leaves much less, that is what was meant."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from camcomp.ground.errors import ConfigError, Location

BETTER = 0.2  # of the misfit: what another reading has to leave to be what was meant
ROWS_APART = (1, -1, 2, -2, 3, -3)  # by which columns of one log may have slipped
Reading = tuple[str, str, Callable[[], float]]  # rule, what the log looks like, misfit


def refuse_as_read(log: str, misfit: float, others: Iterable[Reading]) -> None:
    """Raise ConfigError of the first other reading of a log that leaves much less than `misfit`, in the same unit."""
    for rule, text, other in others:
        if other() < BETTER * misfit:
            raise ConfigError(rule, text, at=Location(log, 1, 1))
