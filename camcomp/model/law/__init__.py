"""Laws and maps that were found rather than known: formulas over what the machine does, and where they were seen."""
