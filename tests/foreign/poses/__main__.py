"""`python -m tests.foreign.poses --out DIR --count N --seed S [--machine NAME]`."""

from tests.foreign.command import write_all
from tests.foreign.poses.make import MACHINES, make

if __name__ == "__main__":
    write_all("tests.foreign.poses", make, "--machine", MACHINES)
