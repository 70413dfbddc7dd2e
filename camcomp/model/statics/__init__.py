"""Statics of the machine: chains, loaded equilibrium, stiffness and modified target (Klimchik et al. 2012), compiled."""
