"""Poses of a robot program moved and split at random, written in its language and read again."""

import numpy as np

from camcomp.gcode.output import Output
from camcomp.gcode.rewrite import rewrite
from camcomp.ground.datatypes import ARC, LINE
from camcomp.ground.orientation import TURN, rotations_of


def written_poses(program, read, seed, turned):
    """The written program, which reads as wanted: tips within 0.1 um, rotations within `turned` (rad)."""
    rng, same = np.random.default_rng(seed), Output.same(program.path)
    rows = np.repeat(np.arange(len(program.path)), [1, *rng.integers(1, 4, len(program.path) - 1)])
    n = len(rows)
    words = program.path.orientation.end[rows] + rng.uniform(-0.1, 0.1, (n, 3))
    kind = np.where(program.path.kind[rows] == ARC, LINE, program.path.kind[rows]).astype(np.int8)
    out = Output(
        motion=rows, kind=kind, end=same.end[rows] + rng.uniform(-1, 1, (n, 3)), centre=np.full((n, 3), np.nan), angle=np.zeros(n),
        feed=same.feed[rows], joining=rng.random(n) < 0.3, words=words, rest=rng.random(n) < 0.3,
    )  # fmt: skip
    written = rewrite(program, out, resolution_mm=1e-4, version="1")
    again = read(written.data)
    np.testing.assert_allclose(again.path.end, out.end, atol=1e-4)
    np.testing.assert_allclose(again.path.end, written.end, atol=1e-9)
    off = rotations_of(TURN, again.path.orientation.end) - rotations_of(TURN, words)
    assert np.abs(off).max() < turned
    np.testing.assert_allclose(again.path.feed, program.path.feed[rows])
    assert again.path.line.tolist() == written.line.tolist()
    return written.data
