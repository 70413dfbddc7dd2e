"""Programs of a megabyte and more: compiled reading, interpolation with its proof, compiled writing."""
