"""Unit tests; the folders are those of the package."""
