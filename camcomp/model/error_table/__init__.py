"""Tables of what an axis errs by over its travel: files, YAML, look-up."""
