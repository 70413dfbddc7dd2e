"""A wheel and a source distribution install and run in a clean environment."""
