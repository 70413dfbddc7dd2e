"""From the chance of a test, and from evidence, to a probability."""

from math import exp, log

EVEN = 0.5  # of an effect, before the data are looked at
PLACES = 4
SURELY = 0.975  # both ends of 95 %
SEED = 20200714  # of all draws: the same answer twice
EQUAL_LOG_ODDS = 3.0  # odds of 20, Kass and Raftery 1995: sets closer than that are not told apart
TEMPERATURE = 1.5  # divides log evidence before it becomes a probability, where the model is as good as its noise


def probability_of_chance(log10_chance: float, prior: float = EVEN) -> float:
    """Probability of an effect where noise alone looks as the data do with the chance p; log10_chance is log10 of p.

    P = 1 / (1 + (1 - prior) / prior * B), and B = -e p ln p is the least Bayes factor for "noise alone" that a chance p
    goes with, 1 where p exceeds 1/e: no prior of the effect's size can make more of p. Source: Sellke, Bayarri, Berger,
    The American Statistician 55 (2001) 62.
    """
    log_chance = log(10.0) * log10_chance
    log_factor = 1.0 + log_chance + log(-log_chance) if log_chance < -1.0 else 0.0
    return 1.0 / (1.0 + (1.0 - prior) / prior * exp(log_factor))


def stated(probability: float) -> float:
    """A probability as a result states it: rounded, and never to one that reads as certain."""
    return min(round(probability, PLACES), 1.0 - 10.0**-PLACES)
