"""Recordings of others to logs: readers of file formats, which column is which, several files for one run."""
