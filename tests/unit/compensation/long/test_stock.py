"""Long programs with a stock: the same engagement, force and text as the exact way."""

import numpy as np
import pytest

from camcomp.compensation.long import runs
from camcomp.ground.errors import ConfigError, ProgramError
from camcomp.ground.files import shipped
from camcomp.model.config.load import load_config
from camcomp.model.job import Job
from tests.benchmarks.programs import groove
from tests.unit.compensation.long.test_program import HEAD, assert_same, both, circle

MECHANISTIC = str(shipped("config/materials/mechanistic-aluminium-7075-t6.yaml"))
STOCK = """
workpiece: {stock: {type: box, min_mm: [-60, -60, -15], max_mm: [60, 60, 2]}}
tool: {diameter_mm: 6, teeth: 2}
"""


@pytest.fixture(autouse=True)
def short_runs(monkeypatch):
    monkeypatch.setattr(runs, "PROBE_MOTIONS", 8)


@pytest.fixture
def job(tmp_path):
    def made(*more, machine="cartesian", text=STOCK):
        (tmp_path / "stock.yaml").write_text(text)
        return Job(load_config([shipped(f"config/{machine}.yaml"), *more, tmp_path / "stock.yaml"]))

    return made


def between():
    """Plain lines and others: arcs, a retract and a second pass through the finished groove, a ramp, a cut beside it."""
    lines = [
        *circle(20), *circle(12, code="", turns=0.3), "G3 X-20 Y0 I6.1804 J-19.0211 F200", *circle(15, radius=21.0),
        "G1 X40 Y0 F500", "Y30", "X-10 Z1", "G0 Z6", "G0 X20 Y0", "G1 Z0 F300", *circle(20), "X30 Y3 Z-1", *circle(18, radius=22.0),
        "G0 Z9", "M5", "M30", "%",
    ]  # fmt: skip
    return HEAD + "\n".join(lines) + "\n"


@pytest.mark.parametrize("model", ["constant", "mechanistic"])
def test_the_engagement_is_the_same_in_pieces(job, model):
    machine = job(*([MECHANISTIC] if model == "mechanistic" else []))
    _, batches = assert_same(machine, between(), feed=1e-3)  # on lines of 0.1 mm, ends within 0.05 um
    _, exact = both(machine, between())
    found = np.concatenate([each.behind for each in batches])[:, -2:]  # behind the bands
    np.testing.assert_allclose(found, exact.rows.engagement, atol=2e-3)
    assert 0.0 < found[:, 0].max() <= 3.0 and found[:, 1].max() == pytest.approx(np.pi, abs=0.01)


def test_a_groove_in_layers(job):
    machine = job(machine="orthoglide-1deg")
    totals, _ = assert_same(machine, "\n".join(groove(300)) + "\n")
    assert totals.failed_checks(1.0) == []


def test_what_is_wrong_with_the_stock_is_told(job):
    with pytest.raises(ProgramError) as found:
        both(job(), between().replace("G0 X20 Y0\n", "G0 X20 Y0 Z-3\nG0 X50 Y50\n", 1))
    assert found.value.rule == "CC142" and found.value.at.line > 5
    with pytest.raises(ConfigError, match="never touches"):
        both(
            job(text=STOCK.replace("min_mm: [-60, -60", "min_mm: [200, 200").replace("[60, 60, 2]", "[300, 300, 2]")),
            between(),
        )


@pytest.mark.parametrize("kind", ["ball", "drill"])
def test_a_tool_that_the_assumed_force_does_not_fit_is_warned_of(job, kind):
    text = HEAD + "\n".join([*circle(20), "G0 Z9", "M30", "%"]) + "\n"
    (_, totals, _), _ = both(job(text=f"tool: {{diameter_mm: 6, type: {kind}}}\n"), text)
    assert any(f"the tool is a {kind}" in each for each in totals.warnings)
