"""Formats that any story may use (page, plot, SARIF, JUnit); no story is known here."""
