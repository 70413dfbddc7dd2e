"""Runs beside the twin as a regression problem: residuals, columns, noise, Gauss-Newton; no cause is judged here."""
