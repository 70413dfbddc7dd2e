"""One file per dialect of NC programs, each with its DIALECT; the common reader is camcomp/gcode."""
