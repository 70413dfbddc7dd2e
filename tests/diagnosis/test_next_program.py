"""Programs of proposed experiments: from above, with the spindle of the runs, to an end, inside the travel, for rs274, too."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from camcomp.api.diagnosis import next_program
from camcomp.diagnosis.experiment.open_experiment import open_experiment
from camcomp.diagnosis.fit.bench import Bench
from camcomp.diagnosis.next_experiment.candidates import by_other_means, candidate, coarse, single_changes, usual
from camcomp.diagnosis.next_experiment.design import MotionDesign
from camcomp.diagnosis.next_experiment.ready_program import CUTS, ready_program
from camcomp.diagnosis.next_experiment.site import site_of
from camcomp.gcode.interpret import read_program
from camcomp.ground import path_geometry
from camcomp.ground.errors import CheckFailed
from camcomp.ground.files import shipped
from tests.oracles import rs274
from tests.validation.runner import invoke

SAMPLE = shipped("samples/diagnosis/ambiguous/experiment.yaml")


@pytest.fixture(scope="module")
def opened():
    return open_experiment(str(SAMPLE))


@pytest.fixture(scope="module")
def bench(opened):
    return Bench(twin=opened.twin, runs=opened.runs[:2])


@pytest.fixture(scope="module")
def every(opened, bench):
    site = site_of(bench, opened.job)
    return [*coarse(site), *by_other_means(site), *single_changes(site)]


@pytest.fixture(scope="module")
def proposals(opened, every):
    return [(each, ready_program(each, opened.runs, opened.job, opened.twin)) for each in every]


@pytest.fixture(scope="module")
def first(opened, bench):
    site = site_of(bench, opened.job)
    return candidate(site, usual(site))


def test_every_experiment_is_a_program_that_a_machine_can_run(proposals):
    assert len(proposals) > 20
    for proposed, text in proposals:
        path = read_program(text.encode(), name="n.nc").path
        core = read_program(proposed.program.encode(), name="c.nc").path
        ends, above = path.end, core.end[:, 2].max() + 2.0
        np.testing.assert_array_equal(path.kind[:3], [0, 0, 1])  # up, across, down
        assert list(path.known[:2]) == [False, True]
        assert ends[0, 2] >= above and ends[1, 2] == ends[0, 2] == ends[-1, 2]
        np.testing.assert_array_equal(ends[1, :2], core.end[0, :2])
        np.testing.assert_array_equal(ends[2:-1], core.end)  # it begins where the plunge ends, and is the same
        lines = text.splitlines()
        assert lines.index("M3 S8000") < lines.index(next(line for line in lines if line.startswith("G1")))
        assert lines[-2:] == ["M5", "M2"]
        assert (f"({CUTS})" in lines) == proposed.cutting


@rs274.needs_rs274
def test_linuxcnc_reads_them(proposals):
    for _, text in proposals:
        seen = rs274.run(text)
        path = read_program(text.encode(), name="n.nc").path
        assert seen.error == ""
        np.testing.assert_allclose(seen.motions[-1].end, path.end[-1], atol=1e-3)


def test_in_the_air_nothing_is_met_that_the_runs_did_not_pass(bench, every):
    """Designs in the air stay above the lowest run in the air; designs that cut stay where the runs cut."""
    runs = dict(zip(("cut", "air"), bench.runs, strict=True))
    lowest = runs["air"].commanded(bench.twin)[:, 2].min()
    been = runs["cut"].commanded(bench.twin)
    for each in every:
        ends = each.design.points()
        if each.cutting:
            assert (np.abs(ends) <= np.abs(been).max(axis=0) + 0.1).all()
            assert each.design.plane == "XY"
        else:
            assert ends[:, 2].min() >= lowest - 0.1


def test_the_same_in_the_language_of_the_control(opened):
    """Dwell in seconds, remarks and units as each control has them; the motion is the same."""
    design = MotionDesign(centre=(5.0, -3.0, 2.0), radius=11.0, feed=700.0, plane="YZ", dwell_s=90.0)
    each = replace(candidate(SimpleNamespace(channels=(), end=0.0), design), action="a (remark)")
    said = {
        "rs274": ("(a remark)", "G4 P90", "G21 G90 G19 G54"),
        "grbl": ("(a remark)", "G4 P90.0", "G21 G90 G19 G54"),
        "fanuc": ("(a remark)", "G4 X90.0", "G21 G90 G19 G54"),
        "sinumerik": (";a remark", "G4 F90.0", "G71 G90 G19 G54"),
    }
    plain = read_program(each.program.encode(), name="plain").path.end
    for dialect, lines in said.items():
        text = ready_program(each, (), opened.job, opened.twin, dialect)
        assert set(lines) <= set(text.splitlines())
        path = read_program(text.encode(), name="n.nc", dialect=dialect).path
        np.testing.assert_array_equal(path.end[2:-1], plain)


def test_heights_stay_inside_the_travel_or_an_error_says_so(opened, first):
    path = read_program(first.program.encode(), name="c.nc").path

    around = path_geometry.points(path, np.ones(200, int), np.linspace(0.0, 1.0, 200))

    def limited(above):
        z = opened.twin.inverse(opened.twin.to_machine(around + [0.0, 0.0, above]))[:, 2].max()
        return SimpleNamespace(machine=SimpleNamespace(limits=[(-1e3, 1e3), (-1e3, 1e3), (-1e3, z)]))

    low = ready_program(first, opened.runs, limited(3.0), opened.twin)
    high = ready_program(first, opened.runs, opened.job, opened.twin)
    heights = [read_program(each.encode(), name="n.nc").path.end[0, 2] for each in (low, high)]
    assert heights[0] < heights[1]
    with pytest.raises(CheckFailed) as caught:
        ready_program(first, opened.runs, limited(-1.0), opened.twin)
    assert caught.value.rule == "CC608"


def test_the_spindle_is_that_of_the_runs(opened, first):

    def with_turn(turn):
        path = opened.runs[0].program
        return [replace(opened.runs[0], program=replace(path, turn=np.full(len(path), turn)))]

    assert "M4 S8000" in ready_program(first, with_turn(-1.0), opened.job, opened.twin)
    silent = ready_program(first, with_turn(np.nan), opened.job, opened.twin)
    assert "M3" not in silent and "M5" not in silent


def test_where_there_is_no_program_an_error_says_so():
    for done, opened in ((None, None), (SimpleNamespace(proposal=None), SimpleNamespace())):
        with pytest.raises(CheckFailed) as caught:
            next_program(done, opened)
        assert caught.value.rule == "CC608"


@pytest.mark.campaign
def test_the_command_warns_of_a_program_that_cuts(tmp_path):
    out = tmp_path / "next.nc"
    code, said = invoke(["diagnose", str(SAMPLE), "--next-program", str(out)])
    assert code == 0
    assert ("proposed program cuts" in said) == (CUTS in out.read_text())
