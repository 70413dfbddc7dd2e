"""Command line: verbs, exit codes, progress, completion, and the generated reference."""
