"""Programs with the canonical moves that they are read as, and programs that are refused."""
