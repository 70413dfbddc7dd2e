"""`python -m tests.foreign.axes --out DIR --count N --seed S [--kind NAME]`."""

from tests.foreign.axes.make import KINDS, make
from tests.foreign.command import write_all

if __name__ == "__main__":
    write_all("tests.foreign.axes", make, "--kind", KINDS)
