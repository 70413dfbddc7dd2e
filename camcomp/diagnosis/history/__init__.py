"""Diagnoses of one machine over months: stored in a folder, with drifts and jumps of their parameters."""
