"""The paper: chains, loaded equilibrium, stiffness, modified target, compiled; no G-code, no time."""
