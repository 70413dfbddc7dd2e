"""YAML text to checked values; every error has file, line and column."""
