from importlib.metadata import EntryPoint

import pytest

from camcomp.ground import shelf
from camcomp.ground.errors import ConfigError, Location


def test_members_are_files_and_private_ones_are_not():
    names = shelf.members("effects")
    assert "backlash" in names
    assert list(names) == sorted(names)
    assert not [name for name in names if name.startswith("_")]


def test_load_gives_the_module():
    assert shelf.load("forces", "none").__name__ == "camcomp.forces.none"


def test_unknown_name_lists_what_there_is():
    at = Location("a.yaml", 1, 2)
    with pytest.raises(ConfigError) as caught:
        shelf.load("forces", "constnat", at=at)
    assert caught.value.rule == "CC213"
    assert caught.value.at == at
    assert "did you mean 'constant'" in caught.value.hint
    assert "kienzle" in caught.value.hint


def test_an_entry_point_is_a_member_and_cannot_hide_an_own_file(monkeypatch):
    points = [
        EntryPoint("mine", "collections:OrderedDict", "camcomp.forces"),
        EntryPoint("constant", "collections:OrderedDict", "camcomp.forces"),
    ]

    def entry_points(group, name=None):
        return [each for each in points if each.group == group and name in (None, each.name)]

    monkeypatch.setattr(shelf, "entry_points", entry_points)
    assert {"mine", "constant"} <= set(shelf.members("forces"))
    assert shelf.load("forces", "mine").__name__ == "OrderedDict"
    assert shelf.load("forces", "constant").__name__ == "camcomp.forces.constant"
