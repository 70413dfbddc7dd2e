"""Experiments on parallel machines (Orthoglide, linear delta, 3-PUU); written from the contract alone."""
