"""Control loops with memory: the written program through filters of our own, on a machine of slides, is on the path at every instant."""

import numpy as np
import pytest
from scipy.signal import cont2discrete, lfilter

from camcomp.compensation.program.compensate import compensate
from camcomp.compensation.program.verify import verify
from camcomp.model.config.load import load_config
from camcomp.model.control import open_program, program_of
from camcomp.model.job import Job

STEP_S, SPEED = 1e-5, 20.0  # of the filters; mm/s
LAG_S, PERIOD_S, DAMPING, PLAY_MM = 0.005, 0.04, 0.4, 0.02
LAG = f"{{effect: servo_lag, time_constant_ms: {1e3 * LAG_S}}}"
SWING = f"{{effect: servo_overshoot, period_ms: {1e3 * PERIOD_S}, damping: {DAMPING}}}"
PLAY = f"{{effect: backlash, target: x, width_mm: {PLAY_MM}}}"
RADIUS_MM = 12.0
START_S = 0.2  # after which loops that swing have settled behind the sudden start
REST_S = 5e-4  # the last line, in front of the stop
PROGRAM = "G21 G90 G17 G94\nG0 X0 Y0 Z0\nG1 X20 F1200\nG3 X20 Y24 J12\nG1 X0\nG3 X0 Y0 J-12\nG1 X20\nM2\n"  # no corner


def loop(way, above, below):
    """Positions (n, 3) behind a transfer function, straight between instants, settled at the start."""
    b, a, _ = cont2discrete((above, below), STEP_S, method="foh")
    return way[0] + lfilter(b.ravel(), a, way - way[0], axis=0)


def lag(way):
    return loop(way, [1.0], [LAG_S, 1.0])


def swing(way):
    w = 2.0 * np.pi / PERIOD_S
    return loop(way, [2.0 * DAMPING * w, w * w], [1.0, 2.0 * DAMPING * w, w * w])


def play(way):
    out, at = way.copy(), way[0, 0]
    for i, x in enumerate(way[:, 0].tolist()):
        at = min(max(at, x - 0.5 * PLAY_MM), x + 0.5 * PLAY_MM)
        out[i, 0] = at
    return out


def stadium(s):
    """Points (n, 3) of the program at ways s (n,) mm behind its start."""
    half = np.pi * RADIUS_MM
    s = np.asarray(s)[:, None]
    a, b = (s - 20.0) / RADIUS_MM, (s - 40.0 - half) / RADIUS_MM
    parts = (
        np.concatenate((s, 0.0 * s), axis=1),
        np.concatenate((20.0 + RADIUS_MM * np.sin(a), RADIUS_MM * (1.0 - np.cos(a))), axis=1),
        np.concatenate((40.0 + half - s, 24.0 + 0.0 * s), axis=1),
        np.concatenate((-RADIUS_MM * np.sin(b), RADIUS_MM * (1.0 + np.cos(b))), axis=1),
        np.concatenate((s - 40.0 - 2.0 * half, 0.0 * s), axis=1),
    )
    ends = np.cumsum([20.0, half, 20.0, half])
    flat = np.select([s <= end for end in ends], parts[:4], parts[4])
    return np.column_stack((flat, np.zeros(len(flat))))


def missed(folder, effects, *machine):
    """Instants (n,) s, and distances (n,) mm of the tip there from the point that the program asks for; and what compensate says."""
    (folder / "effects.yaml").write_text(f"effects: [{', '.join(effects)}]\nprocess: {{force: {{model: none}}}}\n")
    (folder / "in.nc").write_text(PROGRAM)
    config = load_config(["config/cartesian.yaml", folder / "effects.yaml"])
    program = open_program(str(folder / "in.nc"), config)
    result = compensate(program, Job(config), method="newton", tolerance_um=1.0, version="0")
    cut = result.rows.motion > 0
    time, told = np.append(0.0, result.s[cut] / SPEED), result.written.end[cut]
    begin = result.written.end[~cut][-1]
    t = np.arange(0.0, time[-1] - REST_S, STEP_S)
    way = np.column_stack([np.interp(t, time, np.append(a, b)) for a, b in zip(begin, told.T, strict=True)])
    for each in machine:
        way = each(way)
    return t, np.linalg.norm(way - stadium(SPEED * t), axis=1), np.linalg.norm(result.after, axis=1).max()


@pytest.mark.parametrize(
    ("effects", "machine", "begin_s", "most_mm"),
    [
        ([LAG], [lag], 0.0, 1.3e-3),
        ([LAG, PLAY], [lag, play], START_S, 1.3e-3),
        ([SWING], [swing], START_S, 1.2e-3),
        ([SWING, LAG], [swing, lag], START_S, 1.5e-3),
    ],
)
def test_the_tip_is_where_the_program_asks_for_it(tmp_path, effects, machine, begin_s, most_mm):
    t, off, _ = missed(tmp_path, effects, *machine)
    assert off[t > begin_s].max() < most_mm


@pytest.mark.parametrize(("effects", "machine"), [([LAG], [lag]), ([LAG, PLAY], [lag, play])])
def test_the_errors_stated_are_those_of_the_filters(tmp_path, effects, machine):
    t, off, stated = missed(tmp_path, effects, *machine)
    assert stated < 1.0e-3
    assert abs(off[t > START_S].max() - stated) < 3e-4


CORNERS = "G21 G90 G17 G94\nG0 X0 Y0 Z0\nG1 X20 F1200\nG3 X20 Y24 J12\nG1 X0\nG3 X0 Y0 J-12\nG1 X20\nG1 Y10 F600\nG1 X5\nG2 X5 Y-10 R10\nG0 Z3\nM2\n"


@pytest.mark.parametrize("effect", [LAG, PLAY])
def test_verify_finds_the_lines_and_places_of_the_correction(tmp_path, effect):
    """What lies off the path at a first guess of its place is looked for again, and lines at reversals are no joining lines."""
    (tmp_path / "effects.yaml").write_text(f"effects: [{effect}]\n")
    (tmp_path / "in.nc").write_text(CORNERS)
    config = load_config(["config/orthoglide-1deg.yaml", tmp_path / "effects.yaml"])
    program, job = open_program(str(tmp_path / "in.nc"), config), Job(config)
    result = compensate(program, job, method="newton", tolerance_um=1.0, version="0")
    found = verify(program_of(result.written.data, "out.nc", config), program, job)
    assert found.joining == result.rows.joining.sum()
    assert found.worst_um < 1e3 * np.linalg.norm(result.after, axis=1).max() + 0.3
