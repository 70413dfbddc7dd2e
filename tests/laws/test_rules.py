"""Every rule id used in camcomp stands in the catalogue, and every id of the catalogue is used."""

import re
from pathlib import Path

import camcomp
from camcomp.ground.rules import RULES

PACKAGE = Path(camcomp.__file__).parent


def used():
    files = [path for path in PACKAGE.rglob("*.py") if path.name != "rules.py"]
    return {rule for path in files for rule in re.findall(r"\"(CC\d{3})\"", path.read_text(encoding="utf-8"))}


def test_every_id_used_is_explained():
    assert used() - set(RULES) == set()


def test_every_id_explained_is_used():
    assert set(RULES) - used() == set()


def test_every_id_is_met_by_a_test():
    """By its name, in a test or in one of the programs that tests read."""
    texts = [
        path.read_bytes() for path in (PACKAGE.parent / "tests").rglob("*") if path.suffix != ".pyc" and path.is_file()
    ]
    met = {rule.decode() for text in texts for rule in re.findall(rb"CC\d{3}", text)}
    assert set(RULES) - met == set()


def test_every_rule_says_something_and_stands_in_order():
    assert list(RULES) == sorted(RULES)
    for rule, text in RULES.items():
        assert text.title and text.explanation.endswith("."), rule
        assert not text.hint.endswith("."), rule
