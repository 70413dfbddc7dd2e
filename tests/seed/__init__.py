"""Figures and behaviours of the compensation paper, end to end."""
