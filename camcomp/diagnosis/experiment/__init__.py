"""Runs from experiment files and logs: reading and checks, without any fit."""
