"""Commands that are killed, run out of disk or meet damaged files leave whole files behind."""
