"""Between the nodes of a driven run the structure carries the force of every row, also where the way turns within a few rows."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from camcomp.ground import shelf
from camcomp.model.config.load import load_config
from camcomp.model.effect import Cause, Load
from camcomp.model.job import Job
from camcomp.model.motion.driven_path import Forces, driven_path
from camcomp.model.motion.driven_pieces import DrivenPieces, near_largest_change, node_loads
from camcomp.model.motion.node_pieces import NODES, direct
from camcomp.model.motion.twin import twin_of

CONFIG = Path(__file__).parents[4] / "config"
STEP_S, FEED, SIDE, RADIUS, FORCE_N = 0.025, 20.0, 30.0, 1.5, 200.0


def rounded_square():
    """Times (n,), tips (n, 3) and directions (n, 3) of a square with rounded corners, driven at an even feed."""
    straight, turn = SIDE - 2 * RADIUS, 0.5 * np.pi * RADIUS
    way = np.arange(0.0, 4 * (straight + turn), FEED * STEP_S)
    side, s = np.divmod(way, straight + turn)
    angle = np.clip((s - straight) / RADIUS, 0.0, None)
    x = np.minimum(s, straight) + RADIUS * np.sin(angle)
    y = RADIUS * (1.0 - np.cos(angle))
    corner, tip = np.zeros(2), np.empty((len(way), 3))
    for k in range(4):
        c, s_ = np.cos(0.5 * np.pi * k), np.sin(0.5 * np.pi * k)
        turned = np.array([[c, -s_], [s_, c]])
        mine = side == k
        tip[mine, :2] = corner + np.column_stack([x, y])[mine] @ turned.T
        corner = corner + turned @ [straight + RADIUS, RADIUS]
    tip[:, 2] = 0.0
    heading = angle + 0.5 * np.pi * side
    return STEP_S * np.arange(len(way)), tip, np.column_stack([np.cos(heading), np.sin(heading), 0.0 * heading])


def a_run(job):
    twin = twin_of(job)
    time, tip, along = rounded_square()
    across = np.cross([0.0, 0.0, 1.0], along)
    n = len(time)
    forces = Forces(FORCE_N * (0.3 * along + across), np.zeros((n, 3)), np.ones(n, bool), np.zeros(n - 1, bool))
    rho = twin.inverse(twin.to_machine(tip))
    return twin, driven_path(twin, "run", time=time, rho=rho, tip=tip, forces=forces, started=0.0)


def at_every_row(twin, run_path, causes):
    """Tips (n, 3) and drives (n, m) of the structure solved at every row under the row's own force."""
    n = len(run_path.time)
    nodes = replace(
        run_path, node_tip=run_path.driven.tip, node_force=run_path.row_force, node_rho=run_path.row_rho,
        node_time=run_path.time, pieces=n, place=lambda at: direct(n),
    )  # fmt: skip
    robot, key = twin.edited(causes)
    load = Load(run_path.row_force, np.zeros((n, 6)))
    solved = twin.structure(nodes, twin._machine(robot, key), key, np.zeros((n, len(twin.actuators))), load)
    return twin.to_program(solved.tip), solved.drive


def cause(name, target, **values):
    effect = shelf.load("effects", name)
    return Cause(name, effect, target, {p.name: p.nominal for p in effect.PARAMETERS} | values)


CHANGED = {  # and share of the deflection that a row may be off by: what the square of the force's change does
    "as it is": ((), 5e-4),
    "softer links": ((cause("link_stiffness", None, factor=0.8),), 2e-3),
    "a softer drive": ((cause("drive_stiffness", "x", factor=0.4),), 5e-4),
}


@pytest.mark.parametrize("change", CHANGED)
@pytest.mark.parametrize("machine", ["router", "puu", "orthoglide"])
def test_rows_follow_their_own_force(machine, change):
    twin, run_path = a_run(Job(load_config([CONFIG / f"{machine}.yaml"])))
    causes, share = CHANGED[change]
    _, solved = twin.sense(run_path)
    reading, _ = twin.sense(run_path, causes, solved=solved, slopes=twin.slopes(run_path, (), solved))
    tip, drive = at_every_row(twin, run_path, causes)
    bent = np.linalg.norm(tip - twin.to_program(run_path.driven.tip), axis=1)
    assert bent.max() > 0.05
    assert np.linalg.norm(reading.tip - tip, axis=1).max() < share * bent.max()
    assert np.abs(reading.drive - drive).max() < 2e-4 * FORCE_N


@pytest.mark.parametrize("corner_N", [0.0, 100.0])
def test_loads_along_an_arc_turn_with_it_whatever_its_last_rows_do(corner_N):
    time = np.arange(0.0, 1.0, 0.01)
    turn = 0.6 * time  # less than 60 degrees: one piece
    along = np.column_stack([np.cos(turn), np.sin(turn), 0.0 * turn])
    force = FORCE_N * along
    force[-6:, 1] -= np.linspace(0.5, 1.0, 6) * corner_N
    none, sure = np.zeros(0, np.int64), np.ones(len(time), bool)
    pieces = DrivenPieces.along(time, time, 10.0 * along, none)
    assert len(pieces.begin) == 1
    pieces = pieces.around(time, near_largest_change(time, force, sure, none, pieces))
    assert len(pieces.begin) == 1 + (corner_N > 0.0)
    loads = node_loads(time, force, sure, none, pieces.node_times(), pieces)
    off = np.linalg.norm(pieces.at(time).of(loads) - force, axis=1)
    assert off[:-6].max() < 2e-4 * FORCE_N
    assert (
        np.linalg.norm(loads, axis=1)[:NODES].max() > FORCE_N
    )  # a cubic that follows an arc is a little larger in places
