"""Texts and plots of a diagnosis."""
