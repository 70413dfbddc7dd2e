"""Spindle words of a program: M4 turns a side force over, M5 and S0 are warned of where the tool cuts."""

import io

import numpy as np
import pytest

from camcomp.compensation.long import runs
from camcomp.compensation.long.program import LongProgram
from camcomp.compensation.program.compensate import compensate
from camcomp.compensation.program.totals import Totals
from camcomp.ground.errors import ConfigError
from camcomp.ground.files import shipped
from camcomp.model.config.load import load_config
from camcomp.model.control import program_of, setup_of
from camcomp.model.job import Job
from camcomp.model.motion.simulate import simulate

HEAD = "G21 G90 G17\nG0 X0 Y0 Z5\nG1 Z0 F200\n"
LINES = "".join(f"G1 X{x} F600\n" for x in range(1, 30))


def job_of(*extra):
    return Job(load_config([shipped("config/router.yaml"), *extra]))


def short(job, text):
    program = program_of(text.encode(), "p.nc", job.config)
    return compensate(program, job, method="newton", tolerance_um=1.0, version="0")


def told(warnings):
    return [each for each in warnings if "spindle" in each]


@pytest.mark.parametrize("how", ["short", "long", "simulate"])
@pytest.mark.parametrize(
    ("words", "lines"),
    [
        ("M3 S9000", ""),
        ("S9000", ""),
        ("M5", "6, 7, 8, 9, 10, 11, 12, 13, 14, 15 ..."),
        ("M4 S0", "6, 7, 8, 9, 10, 11, 12, 13, 14, 15 ..."),
    ],
)
def test_a_stopped_spindle_is_warned_of(monkeypatch, how, words, lines):
    monkeypatch.setattr(runs, "PROBE_MOTIONS", 4)
    job, text = job_of(), f"M3 S12000\n{HEAD}{words}\n{LINES}G0 Z5\nM30\n"
    if how == "short":
        warnings = Totals.of(short(job, text), job).warnings
    elif how == "long":
        bulk = LongProgram(job=job, name="p.nc", setup=setup_of(job.config), tolerance_um=1.0, version="0")
        warnings = bulk.run(io.BytesIO(text.encode()), len).warnings
    else:
        warnings = simulate(job, program_of(text.encode(), "p.nc", job.config).path, 0.1).warnings
    expected = f"the tool cuts with the spindle stopped (M5 or S0) at source line{'s' if ',' in lines else ''} {lines}"
    assert told(warnings) == ([expected] if lines else [])


def test_air_needs_no_spindle():
    job = Job(load_config([shipped("config/cartesian.yaml"), shipped("config/no-force.yaml")]))
    assert told(Totals.of(short(job, f"M5\n{HEAD}{LINES}M30\n"), job).warnings) == []


def test_the_sense_is_that_of_each_line():
    turned = short(job_of(), f"M3 S9000\n{HEAD}G1 X20 F600\nM4\nX40\nM30\n")
    side = np.array([turned.rows.force[turned.lines == line][-1, 1] for line in (5, 7)])
    assert side[0] > 10.0  # M3 pushes the tool to its left
    assert side[1] == -side[0]


def test_a_machine_file_that_contradicts_is_refused_with_its_place(tmp_path):
    extra = tmp_path / "extra.yaml"
    extra.write_text("process:\n  force:\n    spindle: counterclockwise\n")
    job = job_of(str(extra))
    assert short(job, f"M4 S9000\n{HEAD}{LINES}M30\n").rows.force[:, 1].min() < -10.0
    with pytest.raises(ConfigError, match="program line 5") as caught:
        short(job, f"M3 S9000\n{HEAD}{LINES}M30\n")
    assert caught.value.rule == "CC258"
    assert caught.value.at is not None and caught.value.at.file.endswith(".yaml")
