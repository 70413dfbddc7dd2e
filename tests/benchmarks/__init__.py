"""Times and memory of commands, run by `pytest -m benchmarks`."""
