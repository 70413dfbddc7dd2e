"""Experiments on five machines that follow recorded motions; the plant shares geometry and names with camcomp."""
