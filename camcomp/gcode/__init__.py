"""Reading of NC programs to tool paths and rewriting of their text, for all dialects; unchanged lines keep their bytes."""
