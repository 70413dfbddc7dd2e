"""Single set-points on-line: one line in, one line out."""
