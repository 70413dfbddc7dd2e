"""Experiment files and logs to runs: reading, checking, importing the recordings of others; nothing is fitted here."""
