"""Programs with effects, whose points are solved by interpolation."""

import numpy as np
import pytest

from camcomp.api.compensation import compensate
from camcomp.compensation.long import answers as answers_module
from camcomp.compensation.long.answers import with_answers
from camcomp.ground.files import shipped
from camcomp.model.config.load import load_config
from camcomp.model.job import Job
from camcomp.model.statics.solve import FREE, TARGET, solve
from tests.benchmarks.programs import groove

EFFECTS = """
effects:
  - {effect: joint_offset, target: x, offset_mm: 0.02}
  - {effect: screw_pitch, target: y, error_ppm: 30}
"""


@pytest.fixture(scope="module", autouse=True)
def folder(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("NUMBA_CACHE_DIR", str(tmp_path_factory.mktemp("cubes")))
        yield


@pytest.fixture(scope="module")
def job(tmp_path_factory):
    file = tmp_path_factory.mktemp("job") / "effects.yaml"
    file.write_text(EFFECTS)
    return Job(load_config([shipped("config/orthoglide-1deg.yaml"), file]))


@pytest.fixture(scope="module")
def program():
    return "\n".join(groove(600)).encode()


@pytest.fixture(scope="module")
def both(job, program):
    """The same program solved exactly and by interpolation."""
    exact = compensate(program, job)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(answers_module, "LEAST_MOTIONS", 500)
        return exact, compensate(program, job)


def test_outputs_are_those_of_exact_solutions_within_a_tenth_of_a_micrometre(both):
    exact, interpolated = (each.outcome for each in both)
    assert exact.interpolated is None and interpolated.interpolated is not None
    assert len(exact.rows.end) == len(interpolated.rows.end)
    assert np.abs(exact.written.end - interpolated.written.end).max() < 1.5e-4, "the last of four decimals"
    assert np.abs(exact.state.rho - interpolated.state.rho).max() < 1.5e-4
    assert np.abs(exact.state.drive - interpolated.state.drive).max() < 0.05
    assert np.abs(exact.uncorrected - interpolated.uncorrected).max() < 5e-5


def test_the_summary_says_how_far_a_sample_is_from_exact_solutions(both):
    figures = both[1].summary.interpolation
    assert figures is not None and 0.0 < figures.worst_um <= figures.bound_um and figures.checked > 500
    assert both[0].summary.interpolation is None and not both[1].failed


def test_a_sample_too_far_from_its_exact_solutions_fails_the_program(job, program, monkeypatch):
    monkeypatch.setattr(answers_module, "LEAST_MOTIONS", 500)
    whole = answers_module.InterpolatedMachine.solve

    def bent(self, mode, near, force, rho, **how):
        found = whole(self, mode, near, force, rho)
        found.commanded[:] += 1e-4 * (mode == TARGET)
        return found

    monkeypatch.setattr(answers_module.InterpolatedMachine, "solve", bent)
    assert "CC607" in {rule for rule, _ in compensate(program, job).failed}


def test_a_job_with_answers_keeps_what_it_has_built(job):
    machine, conditions, exact = job.machine, job.conditions, job.correctable
    other = with_answers(job)
    assert other.machine is machine and other.conditions is conditions and other.fingerprint == job.fingerprint
    assert other.correctable is not exact and job.real_machine.answers is None is not other.real_machine.answers


@pytest.mark.parametrize("mode", [FREE, TARGET])
def test_single_points_are_the_exact_ones(job, mode):
    machine = with_answers(job).real_machine
    rng = np.random.default_rng(5)
    tip = job.frame.to_machine(rng.uniform(-20.0, 20.0, (60, 3)) * [1.0, 1.0, 0.2])
    force = rng.uniform(-200.0, 200.0, (60, 3)) * [1.0, 1.0, 0.1]
    rho = None if mode == TARGET else machine.answers.set_points(tip, force) + rng.uniform(-0.1, 0.1, (60, 3))
    exact = solve(job.real_machine, mode, tip, force=force, rho=rho)
    found = solve(machine, mode, tip, force=force, rho=rho)
    for name in ("tip", "commanded", "rho", "tilt"):
        assert getattr(found, name) == pytest.approx(getattr(exact, name), abs=5e-5), name
    assert found.drive == pytest.approx(exact.drive, abs=0.05)
