"""The plainest test of the diagnosis, of every effect on every shipped machine: `simulate`, a little noise, `diagnose`."""

import pytest

from camcomp.ground import shelf
from camcomp.model.config.load import load_config
from camcomp.model.effect import applies
from camcomp.model.job import Job
from tests.validation import runner
from tests.validation.every_machine import grid
from tests.validation.every_machine.shipped import Fault

# Where a cause is named and a 95 % interval misses what is true: it ends at 19.98; those of speed limits are narrower than
# the rows of 10 ms can tell, and miss by 0.02 % at most.
MISSES = {
    ("cartesian", "tool_wear"): ["growth_per_min 20"],
    ("ur10", "speed_limit"): ["speed_rad_per_s 0.043"],
    ("puu", "speed_limit"): ["speed_mm_per_s 16"],
    ("kuka-kr210", "speed_limit"): ["speed_rad_per_s 0.0133"],
}
WITHOUT_A_FAULT = ("orthoglide", "ur10")  # parallel, arm
WITH_ONE = ("orthoglide", "delta", "cartesian")  # the quickest; arms are in other tests, too


def one_of_each():
    """(machine, kind of fault) pairs: every machine once, rare kinds first."""
    machines = {}
    for machine in grid.MACHINES:
        for fault in grid.faults(machine):
            machines.setdefault(kind(fault), []).append(machine)
    chosen = {}
    for each, able in sorted(machines.items(), key=lambda entry: len(entry[1])):
        machine = next((name for name in able if name not in chosen), None)
        if machine:
            chosen[machine] = each
    return set(chosen.items())


def kind(fault):
    """The effect, and whether it is one of a single actuator; lengths and angles are one kind."""
    return fault.effect, fault.target is None


def trials():
    """One fault on some machines, and one machine of each kind without a fault; the other pairs are a campaign."""
    chosen = one_of_each()
    for machine in grid.MACHINES:
        marks = () if machine in WITHOUT_A_FAULT else pytest.mark.campaign
        yield pytest.param(machine, None, id=f"{machine}-nothing", marks=marks)
        for fault in grid.faults(machine):
            marks = () if machine in WITH_ONE and (machine, kind(fault)) in chosen else pytest.mark.campaign
            yield pytest.param(machine, fault, id=f"{machine}-{fault.effect}-{fault.target}", marks=marks)


@pytest.mark.parametrize(("machine", "fault"), list(trials()))
def test_what_is_wrong_is_named_and_nothing_else(machine, fault, tmp_path):
    verdict, bad = grid.answer(tmp_path, machine, fault)
    known = MISSES.get((machine, fault.effect), []) if fault else []
    assert [each.partition(" not in ")[0] for each in bad] == known, (verdict, bad)


def test_every_effect_has_its_row():
    """An effect that is new in camcomp/effects needs one, or a word on where it is tried."""
    assert {effect for effect, *_ in grid.SIZES} | set(grid.ELSEWHERE) == set(shelf.members("effects"))
    for effect, place in grid.ELSEWHERE.items():
        assert effect in (runner.ROOT / place).read_text(encoding="utf-8")


def test_every_shipped_machine_has_its_column():
    """Except the Orthoglide with rolled chains, which is the Orthoglide, and the configuration no-force."""
    shipped = {path.stem for path in (runner.ROOT / "config").glob("*.yaml")} - {"orthoglide-1deg", "no-force"}
    assert shipped == set(grid.MACHINES)


@pytest.mark.parametrize("machine", grid.MACHINES)
def test_what_is_not_tried_on_a_machine_is_not_there(machine):
    tried = {fault.effect for fault in grid.faults(machine)}
    robot = Job(load_config([runner.ROOT / "config" / f"{machine}.yaml"])).machine.robot
    names = [each.name for each in robot.actuators]
    arm, slides = machine in grid.ARMS, machine in grid.SLIDES_IN_A_ROW
    for effect in {each for each, *_ in grid.SIZES} - tried:
        module = shelf.load("effects", effect)
        foreign = (getattr(module, "ARM_ONLY", False) and not arm) or (
            getattr(module, "SLIDES_ONLY", False) and (arm or (module.TARGET == "named" and not slides))
        )
        foreign = foreign or not any(applies(module, robot, target) for target in (None, *names))
        assert foreign or (effect, machine) in grid.NOT_THERE


def result(verdict, *causes, alternatives=()):
    named = [
        {"effect": e, "target": t, "probability": p, "parameters": {"width_mm": {"ci95": ci}}} for e, t, p, ci in causes
    ]
    return {"verdict": verdict, "causes": named, "alternatives": [[{"effect": e, "target": t}] for e, t in alternatives]}  # fmt: skip


@pytest.mark.parametrize(
    ("given", "found"),
    [
        (result("identified", ("backlash", "y", 1.0, (0.01, 0.03))), 0),
        (result("identified", ("backlash", "y", 1.0, (0.03, 0.04))), 1),
        (result("identified", ("backlash", "x", 1.0, (0.01, 0.03))), 2),
        (result("identified", ("backlash", "y", 1.0, (0.01, 0.03)), ("friction", "y", 0.6, (0, 1))), 1),
        (result("ambiguous", ("friction", "y", 0.6, (0, 1)), alternatives=[("backlash", "y"), ("friction", "y")]), 0),
        (result("ambiguous", ("friction", "y", 0.9, (0, 1)), alternatives=[("backlash", "y"), ("friction", "y")]), 1),
        (result("none"), 2),
    ],
)
def test_answers_are_judged(given, found):
    assert len(grid.wrong(given, Fault("backlash", "y", {"width_mm": 0.02}))) == found
