"""One file per effect that a machine may have beyond its model: stage, parameters, and hooks on the signal path."""
