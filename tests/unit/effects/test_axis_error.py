"""Errors of axes by their letters: every one against exact rigid carriages, what is found of them, and the loop closed."""

import json

import numpy as np
import pytest

from camcomp.effects.axis_error import TARGETS
from camcomp.ground.errors import CamcompError
from camcomp.model import signal_path
from camcomp.model.axes import slides_of
from camcomp.model.config.load import load_config
from camcomp.model.effect import Motion
from camcomp.model.job import Job
from tests.validation import runner
from tests.validation.plants.guideways import PROGRAMS, Guideways, experiment, misses

TOOL = 60.0
CARTESIAN, ROUTER = "config/cartesian.yaml", "config/router.yaml"
SLIDES = np.array([[30.0, -20.0, 75.0], [-45.0, 12.0, 40.0], [0.0, 0.0, TOOL], [8.0, 33.0, 52.0]])
WAY = np.array([[1.0, -1, 1], [-1, 1, 1], [1, 1, -1], [-1, -1, -1]])


def job(tmp_path, *effects, machine=CARTESIAN):
    (tmp_path / "more.yaml").write_text(f"tool: {{length_mm: {TOOL}}}\neffects: [{', '.join(effects)}]\n")
    return Job(load_config([machine, tmp_path / "more.yaml"]))


def moved(job):
    """By how much (n, 3) the guideways of the machine move the tip at SLIDES."""
    n, robot = len(SLIDES), job.real_machine.nominal
    none, t = np.zeros((n, 3)), np.arange(n) * 1.0
    motion = Motion(
        time=t,
        common=t,
        cut_min=t,
        temperature=None,
        encoder=SLIDES,
        speed=none,
        direction=WAY,
        home=np.zeros(3),
        stiffness=np.full(3, 1e4),
    )
    tip = SLIDES - [0.0, 0.0, TOOL]
    return signal_path.led(job.causes, tip, motion, robot, job.frame.origin) - tip


@pytest.mark.parametrize("letters", TARGETS)
def test_every_letter_moves_the_tip_as_a_carriage_of_its_own_does(tmp_path, letters):
    """From the program's origin on, where the work was probed; angles by their arm."""
    k, angle = "XYZ".index(letters[2]), letters[1] in "ABC"
    unit = "mrad" if angle else "um"
    got = moved(
        job(
            tmp_path, f"{{effect: axis_error, target: {letters}, linear_{unit}_per_m: 0.3, quadratic_{unit}_per_m2: 2}}"
        )
    )
    zero = TOOL if k == 2 else 0.0

    def law(x, way):
        return 1e-3 * (0.3 * (x - zero) / 1e3 + 2.0 * ((x - zero) / 1e3) ** 2)

    want = Guideways(errors={letters: law}, tool=TOOL).tips(SLIDES) - SLIDES + [0.0, 0.0, TOOL]
    assert np.abs(got - want).max() < 2e-8  # angles of 1e-5: their squares
    assert np.abs(got).max() > 1e-8 or letters in ("ECY", "ECZ")  # these turn the tool about itself


def test_a_table_counts_from_the_machines_zero_and_knows_both_directions(tmp_path):
    text = "{effect: axis_error, target: EYX, positions_mm: [-50, 0, 50], forward_um: [10, 0, 20], reverse_um: [10, 5, 30]}"
    got = moved(job(tmp_path, text))
    assert got[:, 1] == pytest.approx([0.012, 0.0095, 0.0, 0.009]) and not got[:, [0, 2]].any()


def test_a_gantry_bears_its_ram_whatever_links_lie_between(tmp_path):
    robot = job(tmp_path, machine=ROUTER).real_machine.nominal
    assert [axis for axis, _, _ in slides_of(robot)] == [0, 1, 2]
    assert slides_of(Job(load_config(["config/orthoglide.yaml"])).machine.nominal) == []
    assert slides_of(Job(load_config(["config/kuka-kr210.yaml"])).machine.nominal) == []


@pytest.mark.parametrize(
    ("effect", "said"),
    [
        ("{effect: axis_error, target: EAX, linear_um_per_m: 3}", "'linear_um_per_m' is nothing of EAX"),
        ("{effect: axis_error, target: EYX, forward_mrad: [1, 2], positions_mm: [0, 1]}", "'forward_mrad' is nothing of EYX"),
        ("{effect: axis_error, target: EXU}", "'axis_error' has no target 'EXU'"),
        ("{effect: axis_error}", "'axis_error' needs a target"),
        ("{effect: axis_error, target: EXX, positions_mm: [0, 0], forward_um: [1, 2]}", "positions have to rise"),
        ("{effect: axis_error, target: EXX, positions_mm: [0, 1], forward_um: [1]}", "2 positions and 1"),
        ("{effect: axis_error, target: EXX, forward_um: [1]}", "a table has positions_mm"),
    ],
)  # fmt: skip
def test_what_makes_no_sense_is_refused_at_its_place(tmp_path, effect, said):
    with pytest.raises(CamcompError) as error:
        job(tmp_path, effect)
    assert said in str(error.value) and error.value.at.line == 2


@pytest.mark.campaign  # test_every_machine has one in the plain run
def test_bent_and_twisted_guideways_are_found_and_taken_out_of_the_next_program(tmp_path):
    machine = Guideways(errors={"EZX": lambda x, way: 1.5e-5 * x**2, "EAX": lambda x, way: 2e-5 * x}, tool=TOOL)
    path, better = experiment(tmp_path, machine), tmp_path / "better.yaml"
    code, said = runner.invoke(
        ["diagnose", str(path), "--json", str(tmp_path / "r.json"), "--write-config", str(better)]
    )
    assert code == 0, said
    result = json.loads((tmp_path / "r.json").read_text())
    found = {(each["effect"], each["target"]): each["parameters"] for each in result["causes"]}
    assert result["verdict"] == "identified" and set(found) == {("axis_error", "EZX"), ("axis_error", "EAX")}
    for letters, name, value in (("EZX", "quadratic_um_per_m2", 15000.0), ("EAX", "linear_mrad_per_m", 20.0)):
        low, high = found["axis_error", letters][name]["ci95"]
        assert low < value < high
    source, out = tmp_path / "ramps.nc", tmp_path / "out.nc"
    files = [each for name in (better, tmp_path / "tool.yaml") for each in ("--config", str(name))]
    code, said = runner.invoke(["compensate", str(source), *files, "-o", str(out)])
    assert code == 0, said
    assert misses(machine.drive(source.read_text()), PROGRAMS["ramps"]) > 0.03
    assert misses(machine.drive(out.read_text()), PROGRAMS["ramps"]) < 0.004
