"""The stock remembered: what has been cut away, move by move, and where the tool meets what still stands."""
