"""Causes that undo one another at the tip are believed where another channel shows one of them by itself."""

from types import SimpleNamespace

import pytest

from camcomp.diagnosis.search import sound

FORCE, SPRING, FRICTION = 0, 1, 2


@pytest.fixture
def answers(monkeypatch):
    """Whether a set cancels, from what each member does per kind of channel, in units of the noise; 5 um to the tip's."""

    def cancels(does):
        def together(problem, f, members=None):
            chosen = [does[i] for i in (f.members if members is None else members)]
            return {kind: abs(sum(each[kind] for each in chosen)) for kind in ("tip", "drive")}

        monkeypatch.setattr(sound, "signal_rms", together)
        monkeypatch.setattr(sound, "size_um", lambda problem, f, members: 5.0 * together(problem, f, members)["tip"])
        return sound.cancels(None, SimpleNamespace(members=tuple(does)))

    return cancels


@pytest.mark.parametrize("size", [6.0, 40.0])
def test_two_that_only_the_tip_shows_cancel(answers, size):
    both = {FORCE: {"tip": size, "drive": 0.0}, SPRING: {"tip": -size + 0.5, "drive": 0.0}}
    assert answers(both)


@pytest.mark.parametrize("size", [6.0, 40.0])
def test_a_force_that_the_drives_feel_and_softer_links_that_give_way_less(answers, size):
    both = {FORCE: {"tip": size, "drive": 1.3}, SPRING: {"tip": -size + 0.5, "drive": 0.0}}
    assert not answers(both)


def test_what_cancels_in_the_other_channel_too_is_not_shown_by_it(answers):
    both = {FORCE: {"tip": 40.0, "drive": 20.0}, SPRING: {"tip": -39.5, "drive": -19.5}}
    assert answers(both)


def test_a_third_that_another_channel_shows_makes_no_two_others_real(answers):
    every = {
        FORCE: {"tip": 0.0, "drive": 30.0},
        SPRING: {"tip": 40.0, "drive": 0.0},
        FRICTION: {"tip": -39.5, "drive": 0.0},
    }
    assert answers(every)


def test_a_third_in_the_other_channel_shows_none_of_two_that_cancel_in_both(answers):
    every = {
        FORCE: {"tip": 40.0, "drive": 20.0},
        SPRING: {"tip": -39.5, "drive": -19.5},
        FRICTION: {"tip": 0.0, "drive": 30.0},
    }
    assert answers(every)


def test_small_members_are_those_that_are_minor_and_those_of_a_large_ones_actuator(monkeypatch):
    sizes = {0: 1.0, 1: 4.0, 2: 60.0, 3: 4.0}
    monkeypatch.setattr(sound, "size_um", lambda problem, f, members: sizes[members[0]])
    causes = [SimpleNamespace(target=target) for target in (None, "x", "x", "y")]
    problem = SimpleNamespace(columns=SimpleNamespace(candidates=causes), floor=SimpleNamespace(tip_um=5.0))
    assert sound.small_members(problem, SimpleNamespace(members=(0, 1, 2, 3))) == (0, 1)
