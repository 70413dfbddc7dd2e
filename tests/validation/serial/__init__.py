"""Experiments on serial machines (router, arm, Cartesian); written from the contract alone."""
