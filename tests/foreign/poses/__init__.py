"""Blind experiments of static poses of arms, written from the contract alone."""
