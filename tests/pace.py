"""Whether something ended soon: limits of processor time are those of a usual machine, and a slow one has more."""

import time

USUAL_S = 0.04  # a usual machine's for the loop below


def soon(took: float, limit: float) -> bool:
    """Whether `took` seconds are within a usual machine's limit; only where they are not is it asked how slow this one is now."""
    return took < limit or took < limit * max(_loop() / USUAL_S, 1.0)


def _loop() -> float:
    begun, count = time.process_time(), 0
    for each in range(1_000_000):
        count += each
    return time.process_time() - begun
