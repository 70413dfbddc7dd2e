"""Pure numerics on arrays (evidence, noise, periods, verdicts); nothing here knows a machine."""
