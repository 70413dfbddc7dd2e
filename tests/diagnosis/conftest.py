"""Experiments of the truth plant and their diagnoses, each made once for all tests that look at it."""

import functools

import pytest

from tests.contradictions import contradictions
from tests.validation import runner
from tests.validation.plants.causes import Cause
from tests.validation.plants.experiments import Plan, make, write


class Workshop:
    """Makes experiments and asks camcomp; keeps both."""

    def __init__(self, folder):
        self.folder = folder
        self.made = functools.cache(self._made)
        self.answer = functools.cache(self._answer)

    def _made(self, plan):
        """(path of the experiment, data of the plant)."""
        made = make(plan)
        folder = self.folder / f"experiment-{len(list(self.folder.iterdir()))}"
        return write(made, plan, folder, runner.CONFIG), made

    def _answer(self, plan):
        """Everything behind the diagnosis of a plan: (result as JSON has it, diagnosis, experiment)."""
        from camcomp.api.diagnosis import diagnose

        done = diagnose(self.made(plan)[0])
        assert contradictions(done.result.as_json()) == []
        return done.result.as_json(), done.behind, done.opened


@pytest.fixture(scope="session")
def workshop(tmp_path_factory):
    return Workshop(tmp_path_factory.mktemp("workshop"))


def plan_of(*causes, design="four", channels="all", ratio=8.0, seed=61, samples=120):
    """A small experiment: causes are (effect, target)."""
    found = tuple(Cause(effect, target, 5) for effect, target in causes)
    return Plan(seed, found, (ratio,) * len(found), design, channels, samples)
