"""One program as a whole: corrected, divided, rewritten, verified."""
