"""The machine in time and along a program: signal path, run path, the twin that simulates and is compared with
logs.
"""
