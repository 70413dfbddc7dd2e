"""Tests of the Python interface, as a script and as a notebook use it."""
