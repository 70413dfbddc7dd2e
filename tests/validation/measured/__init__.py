"""Measured data sets of real machines, and their textbook opponents."""
