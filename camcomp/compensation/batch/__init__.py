"""Many programs at once: which, by which workers, and what became of each."""
