"""The model of the controller against LinuxCNC's planner: accuracy by the truth plant, and the time.

The long version records anew: `python -m pytest -m campaign tests/control -s`.
"""

import shutil

import pytest

from tests.control import driven
from tests.control.programs import LONG, SHORT
from tests.control.record import record

UM, SHARE, TIME = 0.5, 0.1, 0.03


def near(measured, modelled):
    return abs(modelled - measured) <= max(UM, SHARE * measured)


@pytest.fixture(scope="module")
def machine():
    return driven.job()


@pytest.mark.parametrize("name", SHORT)
def test_accuracy_and_time_are_those_of_the_control(name, machine):
    found = driven.account(driven.load(name), machine)
    assert near(*found.most) and near(*found.rms), found.row()
    assert found.time[1] == pytest.approx(found.time[0], rel=TIME), found.row()


@pytest.mark.parametrize("shape", ["raster500", "surface300"])
def test_lines_that_are_kept_apart_stay_near_the_path_on_the_control(shape, machine):
    merged, apart = (driven.account(driven.load(f"{shape}{way}-p10-f3000"), machine) for way in ("", "apart"))
    assert merged.most[0] > 9.0 and apart.most[0] < 0.3 * merged.most[0], (merged.row(), apart.row())
    assert apart.time[0] < 1.02 * merged.time[0]


@pytest.mark.campaign
@pytest.mark.skipif(shutil.which("linuxcnc") is None, reason="needs LinuxCNC")
def test_the_same_of_every_shape_mode_and_feed(machine, tmp_path):
    record(LONG, tmp_path)
    wrong = []
    for name in LONG:
        found = driven.account(driven.load(name, tmp_path), machine)
        print(f"{name:24s} {found.row()}")
        good = near(*found.most) and near(*found.rms) and abs(found.time[1] / found.time[0] - 1.0) <= TIME
        wrong += [] if good else [name]
    assert not wrong
