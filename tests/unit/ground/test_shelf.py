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
