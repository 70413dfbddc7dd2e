"""What to measure next and the program that does it."""
