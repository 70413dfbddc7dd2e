"""Trajectory of a controller for the moves of a program: merged lines, blended corners, speed along them."""
