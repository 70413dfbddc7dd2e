"""Laws of the repository: architecture, rules, names, documents that are generated."""
