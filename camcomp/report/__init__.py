"""Report formats for all commands: HTML page, plots, SARIF, JUnit."""
