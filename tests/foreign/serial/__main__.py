"""`python -m tests.foreign.serial --out DIR --count N --seed S [--machine NAME]`."""

from tests.foreign.command import write_all
from tests.foreign.serial.make import MACHINES, make

if __name__ == "__main__":
    write_all("tests.foreign.serial", make, "--machine", MACHINES)
