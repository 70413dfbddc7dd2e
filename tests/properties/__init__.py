"""Properties that hold for random programs and for files changed at random."""
