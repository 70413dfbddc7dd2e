"""Causes that undo one another at the tip are believed where another channel shows one of them by itself.

What is minor is named nowhere; the others are as likely as they are together with it.
"""

from types import SimpleNamespace

import numpy as np
import pytest

from camcomp.diagnosis.search import sound
from camcomp.diagnosis.statistics.cause_sets import CausePrior, Fitted, probabilities

FORCE, SPRING, FRICTION = 0, 1, 2
ROWS = 3600


@pytest.fixture
def answers(monkeypatch):
    """Whether a set cancels, from what each member does per kind of channel, in units of the noise; 5 um to the tip's."""

    def cancels(does):
        def together(problem, f, members=None):
            chosen = [does[i] for i in (f.members if members is None else members)]
            return {kind: abs(sum(each[kind] for each in chosen)) for kind in ("tip", "drive")}

        monkeypatch.setattr(sound, "signal_rms", together)
        monkeypatch.setattr(sound, "rows_by_kind", lambda problem: {"tip": ROWS, "drive": ROWS})
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


@pytest.mark.parametrize(("drive", "cancels"), [(0.28, False), (0.07, True)])
def test_a_force_that_all_rows_of_the_drives_together_show_is_no_choice_of_the_fit(answers, drive, cancels):
    both = {FORCE: {"tip": 2.76, "drive": drive}, SPRING: {"tip": -2.44, "drive": 0.0}}
    assert answers(both) is cancels


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
    monkeypatch.setattr(sound, "size_um", lambda problem, f, members: sum(sizes[i] for i in members))
    causes = [SimpleNamespace(target=target) for target in (None, "x", "x", "y")]
    problem = SimpleNamespace(columns=SimpleNamespace(candidates=causes), floor=SimpleNamespace(tip_um=5.0))
    assert sound.small_members(problem, SimpleNamespace(members=(0, 1, 2, 3))) == (0, 1)


@pytest.mark.parametrize(
    ("size", "target", "beside", "small"),
    [
        (4.0, None, "x", True),
        (4.0, "y", None, True),
        (4.0, "y", "x", False),  # another actuator's
        (5.2, None, "x", False),  # above the floor
        (5.2, "y", None, False),
    ],
)
def test_one_of_no_actuator_below_the_floor_is_what_a_large_ones_law_says_wrongly(
    monkeypatch, size, target, beside, small
):
    sizes = {0: size, 1: 60.0}
    monkeypatch.setattr(sound, "size_um", lambda problem, f, members: sum(sizes[i] for i in members))
    causes = [SimpleNamespace(target=target), SimpleNamespace(target=beside)]
    problem = SimpleNamespace(columns=SimpleNamespace(candidates=causes), floor=SimpleNamespace(tip_um=5.0))
    assert (sound.small_members(problem, SimpleNamespace(members=(0, 1))) == (0,)) is small


@pytest.mark.parametrize(("targets", "small"), [(("x", "x"), (1, 2)), (("x", "y"), ()), ((None, None), ())])
def test_two_at_one_actuator_that_undo_each_other_are_as_small_as_they_are_together(monkeypatch, targets, small):
    """A force of 127 um, and at one actuator 9.2 um of growth of which another growth undoes 5.4."""
    sizes = {0: 127.0, 1: 9.2, 2: -5.4}
    monkeypatch.setattr(sound, "size_um", lambda problem, f, members: abs(sum(sizes[i] for i in members)))
    causes = [SimpleNamespace(target=target) for target in (None, *targets)]
    problem = SimpleNamespace(columns=SimpleNamespace(candidates=causes), floor=SimpleNamespace(tip_um=5.2))
    assert sound.small_members(problem, SimpleNamespace(members=(0, 1, 2))) == small


FREE = CausePrior(tuple((i,) for i in range(6)), np.log(np.full(6, 1 / 6)), lambda i, j: {i, j} == {1, 5})


def fitted(evidence, *members):
    return Fitted(
        members=members, theta=np.zeros(len(members)), covariance=np.eye(len(members)), log_evidence=evidence, grams=()
    )


@pytest.fixture
def weighed(monkeypatch):
    """A search in which 2 is minor wherever it is, and sets that were not fitted explain nothing."""
    monkeypatch.setattr(sound, "small_members", lambda problem, f: tuple(i for i in f.members if i == 2))
    monkeypatch.setattr(sound, "cancels", lambda problem, f: False)
    return sound.Sound(SimpleNamespace(candidates=FREE)), lambda members: fitted(-90.0, *members)


def test_what_is_minor_is_there_and_nobody_names_it(weighed):
    """Without it (0, 1) explains less than (0, 3, 4), two that undo one another in its place; with it more."""
    search, fit = weighed
    done = {f.members: f for f in (fitted(0.0, 0, 1), fitted(14.0, 0, 1, 2), fitted(10.0, 0, 3, 4))}
    first, second = search.answers(done, fit)
    assert (first.members, first.minor, first.all_members) == ((0, 1), (2,), (0, 1, 2))
    assert second.members == (0, 3, 4)
    assert probabilities((first, second), FREE)[0] == pytest.approx(1 / (1 + np.exp(-4.0)))


def test_what_is_minor_makes_no_answer_likelier_once_evidence_is_tempered(weighed):
    search, fit = weighed
    done = {f.members: f for f in (fitted(0.0, 0, 1), fitted(2.0, 0, 1, 2))}
    assert FREE.value(done[0, 1, 2]) > FREE.value(done[0, 1])
    assert [f.minor for f in search.answers(done, fit)] == [(2,)]
    assert [f.minor for f in search.answers(done, fit, 1.5)] == [()]
