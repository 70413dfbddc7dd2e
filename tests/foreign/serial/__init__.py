"""Serial machines, router, arm and Cartesian: a plant and its experiments, written from the contract alone."""
