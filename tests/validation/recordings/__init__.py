"""Motions that LinuxCNC's planner commanded, recorded at 1 kHz, with their programs."""
