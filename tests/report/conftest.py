"""A compensation report made as a user makes it, and a browser to look at it."""

import pytest

from camcomp.terminal.cli import run
from tests.commandline import ROOT
from tests.report.browser import Browser


@pytest.fixture(scope="session")
def report(tmp_path_factory):
    """The report of the small groove on the imperfect machine."""
    folder = tmp_path_factory.mktemp("report")
    out = folder / "report.html"
    words = ["compensate", ROOT / "samples/groove-circle-2.nc", "--config", ROOT / "config/orthoglide-1deg.yaml"]
    assert run([str(each) for each in (*words, "-o", folder / "out.nc", "--report", out)]) == 0
    return out


@pytest.fixture(scope="session")
def browser(tmp_path_factory):
    """One browser for all tests."""
    made = Browser(tmp_path_factory.mktemp("profile"))
    yield made
    made.close()
