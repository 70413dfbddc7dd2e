"""How the documentation is built: hooks of MkDocs and the scripts that make its drawings."""
