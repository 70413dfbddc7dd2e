"""Model of the stock: a height field from which moves cut material, and the engagement of the tool with it."""
