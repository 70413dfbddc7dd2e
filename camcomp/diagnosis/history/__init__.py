"""Diagnoses of one machine over months: kept in a folder, and what drifts or jumps in them. May know results and numbers, no runs."""
