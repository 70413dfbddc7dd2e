"""Tests of camcomp; they compute with one thread each, as `camcomp` itself does."""

import os

# Threads of the linear algebra wait for each other in loops: on a machine that does other things, or runs tests side by side,
# a diagnosis then takes six times the processor time. It has to be said before numpy is imported.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
