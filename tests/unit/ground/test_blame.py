"""Whose fault an error is."""

import signal

import pytest

from camcomp.ground.blame import blamed
from camcomp.ground.errors import ConfigError, FileError, Terminated


@pytest.mark.parametrize(
    "stop", [KeyboardInterrupt(), Terminated(signal.SIGTERM), FileError("CC503", "a disk is full")]
)
def test_a_plugin_is_not_blamed_for_what_happens_to_camcomp(stop):
    with pytest.raises(type(stop)) as raised, blamed("a plug-in"):
        raise stop
    assert raised.value is stop


@pytest.mark.parametrize("error", [KeyError("x"), SystemExit(0), MemoryError()])
def test_a_plugin_is_blamed_for_what_it_raises(error):
    with pytest.raises(ConfigError, match="a plug-in raised") as raised, blamed("a plug-in"):
        raise error
    assert raised.value.rule == "CC281" and raised.value.__cause__ is error
