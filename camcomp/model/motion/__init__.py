"""Motion of the machine in time and along a program: run path, response to commands, and the twin of a logged run."""
