"""Design of the next experiment, and its program."""
