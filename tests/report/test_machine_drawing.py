"""The machine as lines: legs that end where the platform is, on every shipped machine, and the figure of a program."""

import json
import re

import numpy as np
import pytest

from camcomp.compensation.report.machine_drawing import leg_of
from camcomp.model.config.load import load_config
from camcomp.model.job import Job
from camcomp.model.motion.twin import twin_of
from camcomp.model.statics.description import Actuator, Parallelogram
from camcomp.terminal.cli import run
from tests.commandline import ROOT

MACHINES = sorted(
    path for path in (ROOT / "config").glob("*.yaml") if "\nrobot:" in path.read_text(encoding="utf-8")
    or path.read_text(encoding="utf-8").startswith("robot:")
)  # fmt: skip


def legs(path, off):
    """Legs of a machine at its programmed origin and near it: (drawn, chain, reference, coordinates)."""
    job = Job(load_config([str(path)]))
    robot = job.machine.nominal
    tip = job.frame.origin + job.frame.rotation @ np.array(off)
    rho = twin_of(job).inverse(tip[None])[0]
    reference = tip - robot.held_rotation @ robot.tool
    first = 0
    for chain in robot.chains:
        count = sum(isinstance(each, Actuator) for each in chain.elements)
        yield leg_of(chain, rho[first : first + count], robot.held_rotation, reference), chain, reference
        first += count


@pytest.mark.parametrize("path", MACHINES, ids=lambda path: path.stem)
@pytest.mark.parametrize("off", [(0.0, 0.0, 0.0), (20.0, -15.0, 4.0)])
def test_every_leg_ends_at_the_platform(path, off):
    for leg, chain, reference in legs(path, off):
        assert leg is not None, chain.name
        assert leg.nodes[-1] == pytest.approx(reference, abs=1e-3)


def test_the_bars_of_the_orthoglide_have_their_length():
    for leg, chain, _ in legs(ROOT / "config/orthoglide.yaml", (10.0, 5.0, 0.0)):
        (pair,) = (each for each in chain.elements if isinstance(each, Parallelogram))
        assert len(leg.bars) == 2
        assert np.linalg.norm(leg.bars[:, 1] - leg.bars[:, 0], axis=1) == pytest.approx(np.linalg.norm(pair.arm))
        apart = np.linalg.norm(leg.bars[1, 0] - leg.bars[0, 0])
        assert apart == pytest.approx(pair.width)


def test_a_leg_begins_at_its_carriage_where_the_travel_is_known():
    for leg, chain, _ in legs(ROOT / "config/delta.yaml", (10.0, 5.0, 0.0)):
        a, b = leg.way
        assert np.linalg.norm(b - a) == pytest.approx(600.0), "limits of -300 and 300 mm"
        assert np.linalg.norm(np.cross(leg.nodes[0] - a, b - a)) == pytest.approx(0.0, abs=1e-6), chain.name


def test_a_leg_that_cannot_reach_is_left_out():
    (_, chain, reference), *_ = legs(ROOT / "config/orthoglide.yaml", (0.0, 0.0, 0.0))
    assert leg_of(chain, np.array([-350.0]), np.eye(3), reference + [0.0, 0.0, 900.0]) is None


def test_the_figure_enlarges_each_curve_about_its_own_points(tmp_path):
    out = tmp_path / "r.html"
    words = ["compensate", ROOT / "samples/groove-circle-50.nc", "--config", ROOT / "config/delta.yaml", "-o",
             tmp_path / "o.nc", "--report", out]  # fmt: skip
    assert run([str(each) for each in words]) == 0
    text = out.read_text("utf-8")
    assert "Travel left" in text and "Joining lines</dt><dd>2" in text
    data = re.search(r'<script type="application/json" id="figures">(.*?)</script>', text, re.DOTALL)[1]
    (figure,) = (each for each in json.loads(data) if each["name"] == "machine-drawn")
    names = [each["name"] for each in figure["traces"]]
    assert {"leg a", "leg b", "leg c", "tool", "programmed path", "commanded instead"} <= set(names)
    enlarged = figure["exaggerate"]
    tip = [enlarged["shifts"][names.index("tool")][a][1] for a in "xyz"]
    worst = max(
        np.linalg.norm(each)
        for each in zip(
            *(enlarged["shifts"][names.index("original program under load")][a] for a in "xyz"), strict=True
        )
    )
    assert np.linalg.norm(tip) == pytest.approx(worst, rel=0.02), "the tool is drawn where the error is largest"
    leg = enlarged["shifts"][names.index("leg a")]
    assert [leg[a][-1] for a in "xyz"] == pytest.approx(tip, abs=2e-6) and [leg[a][0] for a in "xyz"] == pytest.approx(
        [0] * 3
    )
