"""Which sets of causes are tried, how they are ranked, and whether something unknown is left."""
