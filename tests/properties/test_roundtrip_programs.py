"""Laws of reading and writing, over random programs that use every mode.

Zero correction gives the same bytes; what is written leads where it says; and LinuxCNC agrees with both.
"""

from random import Random

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from camcomp.gcode.interpret import read_program
from camcomp.gcode.output import Output
from camcomp.gcode.rewrite import rewrite
from camcomp.gcode.setup import Setup
from camcomp.ground.datatypes import ARC, RAPID
from tests.displaced import arcs_bent, divided, shifted
from tests.nc_writer import ProgramWriter
from tests.oracles import compare, rs274

TOOLS = {1: 12.5, 2: 30.0}
HOMES = {28: (1.0, 2.0, 50.0), 30: (-5.0, 4.0, 60.0)}
SETUP = Setup(tools=TOOLS, home_mm=HOMES[28], second_home_mm=HOMES[30])
many = settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.too_slow])
few = settings(max_examples=15, deadline=None, suppress_health_check=[HealthCheck.too_slow])
seeds = st.integers(0, 2**32 - 1)


def read(data, name="in.ngc"):
    return read_program(data if isinstance(data, bytes) else data.encode(), name=name, setup=SETUP, dialect="rs274")


def random_program(seed, length=40):
    random = Random(seed)
    return ProgramWriter(random, SETUP).program(length), random


def without_stamp(data):
    return b"".join(line for line in data.splitlines(keepends=True) if not line.startswith(b"(camcomp "))


@many
@given(seeds)
def test_zero_correction_gives_the_same_bytes(seed):
    text, _ = random_program(seed)
    program = read(text)
    written = rewrite(program, Output.same(program.path), resolution_mm=1e-4, version="1")
    assert without_stamp(written.data) == text.encode()
    assert (written.end == program.path.end).all()


@many
@given(seeds)
def test_one_changed_motion_leaves_the_lines_before_it_alone(seed):
    text, random = random_program(seed)
    program = read(text)
    free = np.flatnonzero(program.path.known & ~program.path.machine & ~program.sites.fixed)
    if not len(free):
        return
    k = int(free[random.randrange(len(free))])
    same = Output.same(program.path)
    end = same.end.copy()
    end[k:] += 0.25
    centre = same.centre.copy()
    centre[k:] += 0.25
    kind = same.kind.copy()
    kind[(kind == ARC) & (np.arange(len(kind)) == k)] = 1
    out = Output(
        motion=same.motion, kind=kind, end=end, centre=centre, angle=same.angle, feed=same.feed, joining=same.joining
    )
    before = int(program.path.line[k]) - 1
    written = without_stamp(rewrite(program, out, resolution_mm=1e-4, version="1").data)
    assert written.splitlines()[:before] == text.encode().splitlines()[:before]


def check_written(program, out, resolution):
    """The written program leads, line by line, to its words, which are the wanted ones up to rounding."""
    written = rewrite(program, out, resolution_mm=resolution, version="1")
    after = read(written.data, "out.ngc").path
    movable = (program.path.known & ~program.path.machine)[out.motion]
    assert np.abs(written.end - out.end)[movable].max(initial=0.0) <= 0.5001 * resolution
    last = {int(line): k for k, line in enumerate(after.line)}
    for row, line in enumerate(written.line.tolist()):
        motion = out.motion[row]
        if program.sites.fixed[motion]:
            continue
        k = last[line]
        assert np.abs(after.end[k] - written.end[row]).max() < 1e-7
        if out.kind[row] != RAPID and after.kind[k] != RAPID:
            wanted = program.path.feed[motion] if np.isnan(out.feed[row]) else out.feed[row]
            if np.linalg.norm(after.end[k] - after.start[k]) > 0.01:
                assert after.feed[k] == pytest.approx(wanted, rel=2.1e-3)
    return written


@many
@given(seeds, st.sampled_from([1e-4, 1e-3]))
def test_divided_and_moved_programs_lead_where_they_say(seed, resolution):
    text, random = random_program(seed)
    program = read(text)
    check_written(program, divided(program.path, random), resolution)


@many
@given(seeds, st.sampled_from([1e-4, 1e-3]))
def test_moved_arcs_stay_arcs_and_lead_where_they_say(seed, resolution):
    text, random = random_program(seed)
    program = read(text)
    check_written(program, arcs_bent(program.path, random), resolution)
    check_written(program, shifted(program.path, random), resolution)


@rs274.needs_rs274
@few
@given(seeds)
def test_motions_are_those_of_linuxcnc(seed):
    text, _ = random_program(seed)
    run = rs274.run(text, tools=TOOLS, homes=HOMES)
    assert run.error == ""
    assert compare.difference(read(text), run) == ""


@rs274.needs_rs274
@few
@given(seeds, st.sampled_from([divided, shifted, arcs_bent]))
def test_linuxcnc_reads_what_is_written(seed, change):
    text, random = random_program(seed)
    program = read(text)
    written = rewrite(program, change(program.path, random), resolution_mm=1e-3, version="1")
    run = rs274.run(written.data, tools=TOOLS, homes=HOMES)
    assert run.error == ""
    assert compare.difference(read(written.data), run) == ""
