"""One file per control language, each with its DIALECT; what all dialects share lives in gcode."""
