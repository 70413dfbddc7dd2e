"""Can a log be what its columns say? Where another unit, order or sign of them leaves much less, that is what was meant."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import combinations, permutations, product

import numpy as np

from camcomp.ground.datatypes import Floats
from camcomp.ground.errors import ConfigError, Location

BETTER = 0.2  # of the misfit: what another reading has to leave to be what was meant
ROWS_APART = (1, -1, 2, -2, 3, -3)  # by which columns of one log may have slipped
Reading = tuple[str, str, Callable[[], float]]  # rule, what the log looks like, misfit


def refuse_as_read(log: str, misfit: float, others: Iterable[Reading]) -> None:
    """Raise ConfigError of the first other reading of a log that leaves much less than `misfit`, in the same unit."""
    for rule, text, other in others:
        if other() < BETTER * misfit:
            raise ConfigError(rule, text, at=Location(log, 1, 1))


def column_orders(names: Sequence[str]) -> Iterator[tuple[list[int], Floats, str]]:
    """Orders and signs (m,) that m columns may have been meant in, simple ones first, with their text.

    Of up to three columns any; of more, one of them reversed, and two exchanged, all moved on, or all turned round.
    """
    same = tuple(range(len(names)))
    if len(names) <= 3:
        orders, signs = list(permutations(same)), list(product((1.0, -1.0), repeat=len(names)))
    else:
        swaps = [tuple({i: j, j: i}.get(k, k) for k in same) for i, j in combinations(same, 2)]
        orders = [same, *swaps, *(same[-by:] + same[:-by] for by in same[1:]), same[::-1]]
        signs = [tuple(-1.0 if k == j else 1.0 for k in same) for j in (None, *same)]
    for order, sign in product(orders, signs):
        other = [names[i] for i, j in enumerate(order) if i != j]
        turned = [names[i] for i, s in enumerate(sign) if s < 0.0]
        moved = f"{' and '.join(other)} exchanged" if len(other) == 2 else f"{', '.join(other)} in another order"
        texts = [f"with {moved}"] * bool(other) + [f"with {' and '.join(turned)} reversed"] * bool(turned)
        if texts:
            yield list(order), np.array(sign), " and ".join(texts)


def row_shifts(what: str, other: str) -> Iterator[tuple[int, str]]:
    """Rows by which a channel may have slipped against another one, with their text."""
    for by in ROWS_APART:
        rows = f"{abs(by)} row{'s' if abs(by) > 1 else ''}"
        yield by, f"{what} {rows} {'behind' if by < 0 else 'ahead of'} {other}"
