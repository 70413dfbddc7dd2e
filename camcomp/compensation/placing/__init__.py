"""Where on the table a program is cut with the smallest error that compensation cannot be trusted to remove."""
