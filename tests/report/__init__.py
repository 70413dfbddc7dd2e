"""The HTML report: its numbers, its words, and how a browser shows it."""
