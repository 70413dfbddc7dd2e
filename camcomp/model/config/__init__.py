"""YAML text to checked values, every error with its place; nothing is computed here."""
