"""verify finds its way on arcs that are smaller than their correction."""

import numpy as np
import pytest

from camcomp.compensation.program.compensate import compensate
from camcomp.compensation.program.verify import verify
from camcomp.gcode.interpret import read_program
from camcomp.ground.files import shipped
from camcomp.model.config.load import load_config
from camcomp.model.control import open_program, setup_of
from camcomp.model.job import Job

SMALL = (
    "G21 G90 G17 G94\nG0 X10 Y0 Z0\nG1 X11 F300\nG2 X11.02 Y0 I0.01 J0\nG2 X11.3 Y0.2 R0.3\nG2 X11.3 Y0.2 I0.3\nG3 X11.3 Y0.2 I0.05 P2\n"
    "G1 X20 F500\nM2\n"
)


@pytest.mark.parametrize("config", ["config/cartesian.yaml", "config/orthoglide-1deg.yaml"])
def test_small_arcs_are_matched_and_judged(config):
    job = Job(load_config((str(shipped(config)),)))
    program = read_program(SMALL.encode(), name="in.nc")
    result = compensate(program, job, method="newton", tolerance_um=1.0, version="0")
    after = read_program(result.written.data, name="out.nc")
    checked = verify(after, program, job)
    assert 1e3 * np.linalg.norm(result.after, axis=1).max() <= 1.0
    assert 1e3 * checked.residual.max() <= 1.0
    counts = {each.line: each.moves for each in checked.lines}
    rows = result.rows
    for line, moves in counts.items():
        assert moves == ((program.path.line[rows.motion] == line) & ~rows.joining).sum()


def test_what_was_not_corrected_is_seen():
    job = Job(load_config((str(shipped("config/orthoglide-1deg.yaml")),)))
    program = read_program(SMALL.encode(), name="in.nc")
    assert 1e3 * verify(program, program, job).residual.max() > 300.0


@pytest.mark.parametrize("machine", ["puu", "delta", "orthoglide-1deg", "kuka-kr210"])
@pytest.mark.parametrize("sample", ["groove-circle-2.nc", "groove-circle-50.nc"])
def test_verify_and_compensate_agree_on_every_machine(machine, sample):
    """On REF-PUU the force moves the tip by more than the radius of the small circle, and further than the place itself."""
    config = load_config((str(shipped(f"config/{machine}.yaml")),))
    job, program = Job(config), open_program(shipped(f"samples/{sample}"), config)
    result = compensate(program, job, method="newton", tolerance_um=1.0, version="0")
    after = read_program(result.written.data, name="out.nc", setup=setup_of(config))
    assert 1e3 * np.linalg.norm(result.after, axis=1).max() <= 1.0
    assert 1e3 * verify(after, program, job).residual.max() <= 1.0
