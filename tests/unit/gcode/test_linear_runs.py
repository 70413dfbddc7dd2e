"""Runs of plain lines read and written at once give what one line after the other gives, byte by byte."""

import dataclasses
from random import Random

import numpy as np
import pytest

from camcomp.gcode import flow, linear_reader, rewrite
from camcomp.gcode.interpret import read_program
from camcomp.gcode.output import Output
from camcomp.ground.datatypes import ARC, LINE, RAPID
from camcomp.ground.errors import CamcompError
from tests.nc_writer import ProgramWriter

ONE_BY_ONE, AT_ONCE = 1 << 30, 1


def mixed_lines(seed):
    """A program of plain lines in many spellings with comments, M codes, deleted lines and bare modes between them."""
    random = Random(seed)
    lines = ["G21 G90", "G0 X0 Y0 Z5", "G1 Z0 F100"]
    for n in range(100):
        v = random.uniform(0.0, 20.0)
        lines.append(
            random.choice(
                [
                    f"X{v:.3f}", f"G1 X{v:.4f} Y1", f"g1x{v:.3f}y2.5", f"N{n} G1 X{v:.2f} Z-1 M8", f"G0 X{v:.3f} (c)",
                    f"Y{v:.3f} F200", f"M8 ({v:.1f})", f"/X{v:.2f}", "F50 (k)", f"G1 Z-{v:.2f} ; x", "G1", "G0",
                    f"G1 Z{v:.1f} X1 F90 Y3", "G83 Z-3 R1 Q1 F90", "G80 G1", "G91 X1\nG90", "G20\nG21", "G92 X1", "G4 P1", "S900 M3",
                ]
            )
        )  # fmt: skip
    return random.choice(["\n", "\r\n", "\r"]).join(lines).encode("latin-1")


def programs(seed):
    yield mixed_lines(seed)
    yield ProgramWriter(Random(seed), exotic=seed % 2 == 0).program(80).encode()


def columns(read):
    """Everything that a program says of its motions, by name."""
    found = {
        each.name: getattr(part, each.name) for part in (read.path, read.sites) for each in dataclasses.fields(part)
    }
    rest = ("warnings", "rebases", "modes", "straight", "dwelt_s", "tool_changes", "feed_point")
    return found | {name: getattr(read, name) for name in rest}


def read_with(monkeypatch, rows, data):
    monkeypatch.setattr(flow, "MIN_ROWS", rows)
    monkeypatch.setattr(linear_reader, "MIN_RUN", 1)
    monkeypatch.setattr(linear_reader, "MAX_PAUSE", 0)
    try:
        return columns(read_program(data, name="p.nc", dialect="rs274"))
    except CamcompError as error:
        return {"error": str(error)}


@pytest.mark.parametrize("seed", range(30))
def test_read_alike(monkeypatch, seed):
    for data in programs(seed):
        one, other = (read_with(monkeypatch, rows, data) for rows in (ONE_BY_ONE, AT_ONCE))
        assert one.keys() == other.keys()
        for name, value in one.items():
            np.testing.assert_array_equal(other[name], value, err_msg=name)


def displaced(path, rng):
    """An output with every motion moved, some of them divided, some with joining lines, rests and other feeds."""
    count = rng.choice([1, 1, 1, 1, 2, 3], len(path))
    motion = np.repeat(np.arange(len(path)), count)
    step = np.arange(len(motion)) - np.repeat(np.cumsum(count) - count, count)
    kind = np.where(path.kind == ARC, LINE, path.kind)[motion]
    way = (path.end - path.start)[motion] * ((step + 1) / count[motion])[:, None]
    shift = rng.normal(0.0, rng.choice([0.0, 1e-4, 0.05]), way.shape) * (rng.random(len(motion)) < 0.8)[:, None]
    feed = np.nan_to_num(path.feed[motion], nan=100.0) * rng.choice([1.0, 1.0005, 1.2, 0.8], len(motion))
    return Output(
        motion=motion,
        kind=kind,
        end=path.start[motion] + way + shift,
        centre=np.full(way.shape, np.nan),
        angle=np.zeros(len(motion)),
        feed=np.where((kind == RAPID) | (rng.random(len(motion)) < 0.3), np.nan, feed),
        joining=(count[motion] > 1) & (step == rng.integers(2)) & (rng.random(len(motion)) < 0.5),
        rest=rng.random(len(motion)) < rng.choice([0.0, 0.1]),
        apart=np.full(len(motion), rng.random() < 0.3),
    )


def written_with(monkeypatch, motions, read, out):
    monkeypatch.setattr(rewrite, "MIN_MOTIONS", motions)
    monkeypatch.setattr(rewrite, "MIN_RUN", 1)
    try:
        done = rewrite.rewrite(read, out, resolution_mm=1e-4, version="1")
    except CamcompError as error:
        return str(error)
    return done.data, done.end.tolist(), done.line.tolist(), np.nan_to_num(done.feed).tolist()


@pytest.mark.parametrize("seed", range(30))
def test_written_alike(monkeypatch, seed):
    for data in programs(seed):
        try:
            read = read_program(data, name="p.nc", dialect="rs274")
        except CamcompError:
            continue
        out = displaced(read.path, np.random.default_rng(seed))
        one, other = (written_with(monkeypatch, motions, read, out) for motions in (ONE_BY_ONE, AT_ONCE))
        assert one == other
