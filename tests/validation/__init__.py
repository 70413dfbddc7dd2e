"""Validation of the diagnosis: generators of experiments with known causes, measured data, scoring and stored results."""
