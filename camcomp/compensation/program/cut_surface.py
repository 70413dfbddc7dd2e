"""The surface that the loaded machine cuts: the stock follows the tip as it is, not as it is commanded.

The force depends on what the tip meets, what it meets on where the tip is, and that on the force: the three are found in
turns, until the tip rests.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from camcomp.compensation.program.chords import Nodes, trial_nodes
from camcomp.compensation.program.moves import refuse_unsolved, travel_of
from camcomp.gcode.program import Program
from camcomp.ground.datatypes import LINE, RAPID, Floats, Path
from camcomp.ground.errors import ConfigError
from camcomp.ground.headway import steps
from camcomp.model.cutting.engaged import Engaged
from camcomp.model.cutting.track import Track, lay_track
from camcomp.model.job import Job
from camcomp.model.motion.response import respond
from camcomp.model.stock.from_config import Bounds, memory_of
from camcomp.model.stock.surface import Surface, surface_of
from camcomp.model.stock.thinning import thinned

SECTION_MM = 1.0  # of a piece in which the loaded tip goes straight
ROUNDS = 8
STILL_MM = 5e-4  # change of the tip after which it is taken to rest


def cut_surface(job: Job, program: Program) -> Surface:
    """What a program leaves of the stock when the loaded machine executes it as it stands, effects included.

    Raises ConfigError CC298 without a stock, PhysicsError where the machine cannot be.
    """
    if job.config.workpiece.stock is None:
        message = "there is no stock that could be cut"
        raise ConfigError("CC298", message, at=job.config.at("workpiece"), hint="add workpiece: stock")
    path = program.path
    bounds = Bounds().add(path)
    memory = memory_of(job.config, job.tool_axis, bounds)
    engaged = memory.follow(path)[0]
    before = path.end
    for _ in steps(range(ROUNDS), ROUNDS):
        track = lay_track(path, job.conditions, engaged)
        nodes = trial_nodes(track.length, track.angle, track.length > 0.0, SECTION_MM)
        tips = _loaded_tips(job, program, track, nodes)
        memory = memory_of(job.config, job.tool_axis, bounds)
        engaged = _met(track, nodes, memory.follow(_driven(track, nodes, tips))[0])
        last = nodes.first[1:][np.append(track.motion[1:] != track.motion[:-1], True)] - 1
        if np.abs(tips[last] - before).max(initial=0.0) < STILL_MM:
            break
        before = tips[last]
    return surface_of(memory)


def _loaded_tips(job: Job, program: Program, track: Track, nodes: Nodes) -> Floats:
    """Loaded tips (k, 3) mm at the nodes; moves in machine coordinates stay as they are."""
    out = track.points(nodes.piece, nodes.w)
    motion = track.motion[nodes.piece]
    on = np.flatnonzero(track.path.known[motion] & ~track.path.machine[motion])
    travel = travel_of(job, track, nodes.piece[on], nodes.w[on])
    tips, state = respond(job, out[on], travel)
    refuse_unsolved(program, track, nodes.piece[on], out[on], state.status)
    out[on] = tips
    return out


def _driven(track: Track, nodes: Nodes, tips: Floats) -> Path:
    """The way of the tip: straight from node to node; motion k leads to node k + 1."""
    motion = track.motion[nodes.piece[1:]]
    path = track.path.take(motion)
    n = len(motion)
    kind = np.where(path.kind == RAPID, RAPID, LINE)
    return replace(
        path,
        kind=kind,
        start=tips[:-1],
        end=tips[1:],
        centre=np.full((n, 3), np.nan),
        axis=np.zeros((n, 3)),
        angle=np.zeros(n),
    )


def _met(track: Track, nodes: Nodes, driven: Engaged) -> Engaged:
    """What the tip meets on its way, as places of the motions of the program."""
    inside = nodes.piece[driven.motion] == nodes.piece[driven.motion + 1]
    found = driven.take(np.flatnonzero(inside))
    piece, a, b = nodes.piece[found.motion], nodes.w[found.motion], nodes.w[found.motion + 1]
    u = track.u(piece, a + found.u * (b - a))
    return thinned(replace(found, motion=track.motion[piece], u=u))
