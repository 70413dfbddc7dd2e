"""`python -m tests.validation.poses --out DIR --count N --seed S [--machine NAME]`."""

from tests.validation.poses.make import MACHINES, make
from tests.validation.writing import write_all

if __name__ == "__main__":
    write_all("tests.validation.poses", make, "--machine", MACHINES)
