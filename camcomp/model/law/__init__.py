"""Empirical laws and maps: formulas over covariates, with the envelope of the data that support them."""
