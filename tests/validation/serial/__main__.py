"""`python -m tests.validation.serial --out DIR --count N --seed S [--machine NAME]`."""

from tests.validation.serial.make import MACHINES, make
from tests.validation.writing import write_all

if __name__ == "__main__":
    write_all("tests.validation.serial", make, "--machine", MACHINES)
