"""verify under another model than the one that made the program: its residual, said to be that of another model."""

import numpy as np
import pytest

from camcomp.compensation.program.compensate import compensate
from camcomp.compensation.program.verify import verify
from camcomp.gcode.stamp import is_stamped, stamped_model
from camcomp.ground.errors import CheckFailed
from camcomp.ground.files import shipped
from camcomp.model.config.load import load_config
from camcomp.model.control import open_program, program_of
from camcomp.model.job import Job

HALF = "process: {force: {Fr_N: 107.5, Ft_N: -5, Fz_N: -12.5}}\n"


def job_of(*names):
    return Job(load_config([name if "/" in name and name.startswith("/") else str(shipped(name)) for name in names]))


@pytest.fixture(scope="module", params=["samples/groove-circle-50.nc", "samples/groove-circle-2.nc"])
def made(request):
    job = job_of("config/orthoglide-1deg.yaml")
    program = open_program(shipped(request.param), job.config)
    result = compensate(program, job, method="newton", tolerance_um=1.0, version="0")
    return program, program_of(result.written.data, "c.nc", job.config), result, job


def test_under_its_own_model_nothing_is_said(made):
    program, corrected, _, job = made
    done = verify(corrected, program, job)
    assert done.warnings == done.figures(1.0).as_json()["warnings"] == []
    assert 1e3 * done.residual.max() <= 1.0


@pytest.mark.parametrize(
    "other", ["half", "config/orthoglide.yaml", "config/cartesian.yaml", "config/router.yaml", "none"]
)
def test_another_model_answers_with_its_residual(made, tmp_path, other):
    program, corrected, result, job = made
    (tmp_path / "half.yaml").write_text(HALF)
    names = {
        "half": ("config/orthoglide-1deg.yaml", str(tmp_path / "half.yaml")),
        "none": ("config/orthoglide-1deg.yaml", "config/no-force.yaml"),
    }.get(other, (other,))
    there = job_of(*names)
    done = verify(corrected, program, there)
    assert done.joining == result.rows.joining.sum() == 2
    (warning,) = done.warnings
    assert stamped_model(corrected.data) in warning and there.fingerprint in warning
    assert done.figures(1.0).as_json()["warnings"] == done.warnings
    own = {each.line: each.moves for each in verify(corrected, program, job).lines}
    assert {each.line: each.moves for each in done.lines} == own
    if other in ("half", "none"):
        left = 1e3 * np.linalg.norm(result.before, axis=1).max() * (0.5 if other == "half" else 1.0)
        assert 0.4 * left < 1e3 * done.residual.max() < 1.6 * left


def test_another_program_is_still_refused(made):
    _, corrected, _, job = made
    for there in (job, job_of("config/cartesian.yaml")):
        wrong = program_of(b"G21 G90\nG0 X0 Y0 Z0\nG1 X40 F300\nX80\nX120\nY90\nX0\nY0\nM2\n", "w.nc", job.config)
        with pytest.raises(CheckFailed) as caught:
            verify(corrected, wrong, there)
        assert caught.value.rule == "CC604"


def test_the_stamp_tells_machines_and_processes_apart(tmp_path):
    one = job_of("config/orthoglide.yaml")
    assert one.fingerprint == job_of("config/orthoglide.yaml").fingerprint
    assert (
        len({one.fingerprint, *(job_of(f"config/{n}.yaml").fingerprint for n in ("orthoglide-1deg", "puu", "router"))})
        == 4
    )
    same, other = tmp_path / "same.yaml", tmp_path / "other.yaml"
    same.write_text("compensation: {tolerance_um: 3}\ntool: {source: measured again}\n")
    other.write_text("tool: {length_mm: 101}\n")
    assert job_of("config/orthoglide.yaml", str(same)).fingerprint == one.fingerprint
    assert job_of("config/orthoglide.yaml", str(other)).fingerprint != one.fingerprint


def test_a_table_counts_by_its_content(tmp_path):
    force = "process: {force: {model: table, file: forces.csv}}\n"
    marks = []
    for folder, value in (("a", 1), ("b", 1), ("c", 2)):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "forces.csv").write_text(f"line,Fr_N,Ft_N,Fz_N\n1,{value},0,0\n")
        (tmp_path / folder / "f.yaml").write_text(force)
        marks.append(job_of("config/orthoglide.yaml", str(tmp_path / folder / "f.yaml")).fingerprint)
    assert marks[0] == marks[1] != marks[2]


def test_the_stamp_is_one_comment_that_is_recognised(made):
    _, corrected, _, job = made
    line = next(each for each in corrected.data.splitlines() if b"camcomp" in each)
    assert line.startswith(b"(camcomp 0 sha256:") and line.endswith(f" model:{job.fingerprint})".encode())
    assert is_stamped(corrected.data) and line.count(b"(") == line.count(b")") == 1
