"""How far to trust a correction: what uncertain numbers of the config do to the error that is left."""
