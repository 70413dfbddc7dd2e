"""camcomp: writes the deflection of the machine back into the NC program, and says why machine and model differ."""

__version__ = "0.1.0"
