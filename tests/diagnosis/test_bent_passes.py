"""A tool that bends may lie nearer to another pass than to its own: what the line numbers say counts once it is known by how much."""

from types import SimpleNamespace

import numpy as np
import pytest

from camcomp.diagnosis.experiment.driven_run import _aligned
from camcomp.diagnosis.experiment.log_checks import FAR_MM
from camcomp.diagnosis.experiment.logged import Logged
from camcomp.ground.errors import ConfigError
from camcomp.model.config.load import load_config
from camcomp.model.control import open_program

BENT_MM = 1.3
RAMPS = "G0 X-30 Y0 Z5\nG1 Z3 F400\nX30 Z2.2 F1200\nX-30 Z1.4\nX30 Z0.6\nX-30 Z-0.2\nX30 Z-1\nX-30 Z-1.8\nG0 Z5\nM2\n"


@pytest.fixture
def driven(tmp_path):
    """The program, and tips and lines of its ramps."""
    (tmp_path / "p.nc").write_text(RAMPS)
    path = open_program(str(tmp_path / "p.nc"), load_config(["config/cartesian.yaml"])).path
    share = np.linspace(0.0, 1.0, 120, endpoint=False)
    tips = [
        np.column_stack([x * (2.0 * share - 1.0), 0.0 * share, 3.0 - 0.8 * (k + share)])
        for k, x in enumerate([30.0, -30.0] * 3)
    ]
    program = SimpleNamespace(track=SimpleNamespace(path=path))
    return program, np.concatenate(tips), np.repeat(np.arange(3.0, 9.0), len(share))


def logged(line):
    measured = SimpleNamespace(line=line)
    return Logged(
        file="log.csv", run="run", measured=measured, twin=None, started=0.0, temperature=None, acceleration=1.0
    )


def test_lines_are_those_of_another_pass_until_it_is_known_how_far_the_tool_bends(driven):
    program, tip, line = driven
    log = logged(line)
    bent = tip - [0.0, 0.0, BENT_MM]
    found = _aligned(log, program, bent, FAR_MM)
    assert np.mean(program.track.path.line[found.motion] == line) < 0.5  # the case is what it is meant to be
    found = _aligned(log, program, bent + [0.0, 0.0, BENT_MM])
    np.testing.assert_array_equal(program.track.path.line[found.motion], line)


def test_lines_of_another_program_are_refused_then(driven):
    program, tip, line = driven
    with pytest.raises(ConfigError, match="CC406|another program"):
        _aligned(logged(np.maximum(line - 3.0, 2.0)), program, tip)
