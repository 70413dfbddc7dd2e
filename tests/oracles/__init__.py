"""Results against truth that shares no code with camcomp: plants, closed forms, rs274."""
