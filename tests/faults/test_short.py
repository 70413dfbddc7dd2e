"""The quick kinds of the fault campaign, a few times each; `python -m tests.faults --minutes N` does all of them for long."""

import signal

import pytest

from tests.faults import judge
from tests.faults.process import Ended
from tests.faults.table import campaign


def test_nothing_is_lost():
    counts = campaign(0, seed=1)
    assert {name: count.lost for name, count in counts.items() if count.lost} == {}
    assert sum(count.hit for name, count in counts.items() if name.startswith("kill")) >= 6


@pytest.mark.parametrize(
    ("after", "leftovers", "found"),
    [
        ({"in": b"1", "out": b"whole"}, False, None),
        ({"in": b"1", "out": b"who"}, False, "out is half-written"),
        ({"in": b"2"}, False, "in was changed"),
        ({}, False, "in was changed"),
        ({"in": b"1", ".camcomp-1": b""}, False, ".camcomp-1 is left over"),
        ({"in": b"1", ".camcomp-1": b""}, True, None),
    ],
)
def test_damage_is_seen(after, leftovers, found):
    assert judge.damage({"in": b"1"}, after, {"out": b"whole"}, leftovers=leftovers) == found


@pytest.mark.parametrize(
    ("ended", "fine"),
    [
        (Ended(3, "error"), True),
        (Ended(70, "bug"), False),
        (Ended(0, "Traceback (most recent call last)"), False),
        (Ended(143, ""), True),
        (Ended(-signal.SIGSEGV, ""), False),
        (Ended(0, "", hung=True), False),
    ],
)
def test_bad_ends_are_seen(ended, fine):
    assert (judge.wrong(ended, (signal.SIGTERM,)) is None) == fine
