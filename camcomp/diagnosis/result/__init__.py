"""Types of the result of a diagnosis, for all kinds of studies."""
