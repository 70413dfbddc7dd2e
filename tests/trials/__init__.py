"""Trials of `camcomp diagnose`: motion from LinuxCNC's own planner, a tip from a plant that shares nothing with camcomp."""
