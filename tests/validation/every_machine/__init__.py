"""Every effect of the library on every shipped machine, simulated by camcomp itself."""
