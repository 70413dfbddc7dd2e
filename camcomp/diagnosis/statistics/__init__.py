"""Pure numerics on arrays (evidence, noise, periods, verdicts), independent of any machine."""
