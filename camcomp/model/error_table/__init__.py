"""Error tables of an axis over its travel: files, YAML, look-up."""
