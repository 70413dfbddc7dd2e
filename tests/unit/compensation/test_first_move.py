"""Programs whose first motion cuts: the machine stands uncorrected at its start."""

import numpy as np
import pytest

from camcomp.compensation.program.compensate import compensate
from camcomp.compensation.program.verify import verify
from camcomp.gcode.interpret import read_program
from camcomp.ground.files import shipped
from camcomp.model.config.load import load_config
from camcomp.model.job import Job

TEXT = "G21 G90\nG1 X10 Y10 Z0 F100\nX20 Y12\nG0 Z5\nM2\n"


def job_of(*configs):
    return Job(load_config(tuple(str(shipped(each)) for each in configs)))


def test_without_a_force_nothing_changes():
    program = read_program(TEXT.encode(), name="in.nc")
    job = job_of("config/cartesian.yaml", "config/no-force.yaml")
    result = compensate(program, job, method="newton", tolerance_um=1.0, version="0")
    assert result.written.data.split(b"\n", 1)[1] == TEXT.encode()


@pytest.mark.parametrize("config", ["config/cartesian.yaml", "config/orthoglide-1deg.yaml"])
def test_the_first_cut_is_led_onto_its_corrected_path(config):
    program, job = read_program(TEXT.encode(), name="in.nc"), job_of(config)
    result = compensate(program, job, method="newton", tolerance_um=1.0, version="0")
    assert result.rows.joining[0] and not result.rows.joining[1]
    assert 1e3 * np.linalg.norm(result.after, axis=1).max() <= 1.0
    after = read_program(result.written.data, name="out.nc")
    assert 1e3 * verify(after, program, job).residual.max() <= 1.0
    assert after.path.feed[1] == pytest.approx(100.0, rel=0.02)


def test_a_first_move_without_length_does_not_hide_the_start_of_the_cut():
    program = read_program(TEXT.replace("X10 Y10", "X0 Y0").encode(), name="in.nc")
    job = job_of("config/cartesian.yaml")
    result = compensate(program, job, method="newton", tolerance_um=1.0, version="0")
    assert 1e3 * np.linalg.norm(result.after, axis=1).max() <= 1.0
    after = read_program(result.written.data, name="out.nc")
    assert 1e3 * verify(after, program, job).residual.max() <= 1.0
