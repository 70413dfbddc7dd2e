"""`python -m tests.validation.axes --out DIR --count N --seed S [--kind NAME]`."""

from tests.validation.axes.make import KINDS, make
from tests.validation.writing import write_all

if __name__ == "__main__":
    write_all("tests.validation.axes", make, "--kind", KINDS)
