"""A program in its stock as the loaded machine executes it: the tool cuts where it is, not where it is commanded.

The force depends on what the tip meets, what it meets on where the tip is, and that on the force. What was cut before
never changes again, so the tip is led node by node in the order of the program, and at every node force and tip are
brought to rest before anything is cut there. For that the tip is free + slope @ force; what the machine does otherwise
is put right in the next round.
"""

from __future__ import annotations

import numpy as np

from camcomp.compensation.program.division import even_nodes
from camcomp.compensation.program.moves import refuse_unsolved, travel_of
from camcomp.gcode.program import Program
from camcomp.ground import path_geometry
from camcomp.ground.datatypes import RAPID, Bools, Floats, Ints
from camcomp.ground.errors import ConfigError
from camcomp.ground.progress import done, part
from camcomp.ground.records import dataclass, replace
from camcomp.ground.vectors import sizes
from camcomp.model.cutting.frame import lateral
from camcomp.model.cutting.track import PLUNGE_SINE, Track, lay_track
from camcomp.model.job import Job
from camcomp.model.motion.response import respond
from camcomp.model.stock.from_config import Bounds, memory_of
from camcomp.model.stock.legs import SAGITTA_MM
from camcomp.model.stock.memory import StockMemory
from camcomp.model.stock.surface import Surface, surface_of
from camcomp.model.stock.tool_frame import tool_frame_of

STEP_MM = 0.25  # between nodes
PROBE_N = 10.0  # by which the slope is found
STILL_MM = 5e-4  # what a round may put right without another one
REST_MM = 2e-4  # change of the tip at a node after which it rests
ROUNDS, TRIES = 4, 16
SHARP = np.radians(30.0)
FARTHER = 1.5  # times its bend: the way on which a tool comes to be bent otherwise
BASE_MM, LEAST_REACH_MM = 0.15, 0.1
REAL = 0.5  # of the way to where it is told to be that a tip goes over short lines when they are the program's own
LEAST_SHARE = 0.03  # of a step towards the force that was found


@dataclass(frozen=True, eq=False)
class LoadedCut:
    """Cut stock, and the imbalance unrest (k,) mm of tip and force at every solved node; 0: balanced."""

    memory: StockMemory
    unrest: Floats


def loaded_cut(job: Job, program: Program, step_mm: float = STEP_MM) -> LoadedCut:
    """The stock behind a program that the loaded machine has executed; the error is of first order in the step.

    Raises PhysicsError where the machine cannot be.
    """
    path = program.path
    bounds = Bounds().add(path)
    engaged = memory_of(job.config, tool_frame_of(job.config, job.tool_axis), bounds).follow(path)[0]
    track = lay_track(path, job.conditions, engaged)
    way = Way(track, step_mm)
    piece, w, on = way.piece, way.w, way.on
    travel = travel_of(job, track, piece[on], w[on])

    def tips(force: Floats) -> Floats:
        out = way.told.copy()
        loaded = replace(travel, force=job.frame.vectors(force[on]))
        out[on], state = respond(job, way.told[on], loaded)
        refuse_unsolved(program, track, piece[on], way.told[on], state.status)
        return out

    none = np.zeros_like(way.told)
    free = tips(none)
    bends = tips(track.force(piece, w)) - free  # as if the machine were rigid
    reach = max(FARTHER * float(sizes(bends).max(initial=0.0)), LEAST_REACH_MM)
    slope = np.stack([(tips(none + PROBE_N * axis) - free) / PROBE_N for axis in np.eye(3)], axis=2)
    for turn in range(ROUNDS):
        memory = memory_of(job.config, tool_frame_of(job.config, job.tool_axis), bounds)
        with part(turn / ROUNDS, (turn + 1) / ROUNDS):
            force, unrest = _Leading(memory=memory, track=track, way=way, free=free, slope=slope, reach=reach).run()
        off = tips(force) - free - np.einsum("kij,kj->ki", slope, force)
        if np.abs(off).max(initial=0.0) < STILL_MM:
            break
        free = free + off
    return LoadedCut(memory, unrest)


def cut_surface(job: Job, program: Program) -> Surface:
    """Surface that a program cuts as written on the loaded machine, effects included.

    Raises ConfigError CC298 without a stock, PhysicsError where the machine cannot be.
    """
    refuse_without_stock(job)
    return surface_of(loaded_cut(job, program).memory)


def refuse_without_stock(job: Job) -> None:
    """Raises ConfigError CC298 without a stock."""
    if job.config.workpiece.stock is None:
        message = "there is no stock that could be cut"
        raise ConfigError("CC298", message, at=job.config.at("workpiece"), hint="add workpiece: stock")


def meant_cut(job: Job, program: Program) -> StockMemory:
    """The stock that a rigid tool on an exact machine cuts."""
    memory = memory_of(job.config, tool_frame_of(job.config, job.tool_axis), Bounds().add(program.path))
    memory.follow(program.path)
    memory.settle()
    return memory


def nodes_of(program: Program) -> int:
    """About how many nodes `loaded_cut` leads the tip through."""
    feeds = program.path.kind != RAPID
    return int(np.ceil(np.nan_to_num(path_geometry.lengths(program.path)[feeds]) / STEP_MM).sum()) + int(feeds.sum())


class Way:
    """Nodes (k,) of a track in order, first and last of every piece among them.

    At most step_mm apart where the tool feeds, and so that chords of arcs miss by less than SAGITTA_MM.
    """

    def __init__(self, track: Track, step_mm: float) -> None:
        path, motion, n = track.path, track.motion, len(track.motion)
        seen = path.known[motion] & ~path.machine[motion]
        feeds = (path.kind[motion] != RAPID) & seen & (track.length > 0.0)
        angle = np.abs(track.angle)
        radius = np.divide(track.length, angle, out=np.full(n, np.inf), where=angle > 0.0)
        step = np.minimum(step_mm, np.sqrt(8.0 * SAGITTA_MM * radius))
        count = np.where(feeds, np.maximum(np.ceil(track.length / np.maximum(step, 1e-3)), 1), 1).astype(np.int64) + 1
        nodes = even_nodes(count)
        self.piece, self.w = piece, w = nodes.piece, nodes.w
        self.told = track.points(piece, w)  # (k, 3) mm programmed tip
        self.direction = _directions(
            track, feeds, piece, w
        )  # (k, 3) of the feed; where pieces join that between theirs
        self.on = np.flatnonzero(seen[piece])  # rows that are in program coordinates
        self.feeds = feeds[piece]  # the piece takes material away
        across = lateral(self.direction, np.asarray(track.conditions.tool_axis)) > PLUNGE_SINE
        self.loads = self.feeds & across & (track.conditions.model is not None)  # the force of what the tool meets acts
        # (k, 3) N of models that know the force of a plunge, too
        self.fixed = track.force(piece, w) if track.conditions.plunges else np.zeros((len(piece), 3))
        self.s = track.s0[piece] + w * track.length[piece]  # mm of the program's way
        run = _runs(track, feeds)
        self.run = run[piece]  # number of the run of feeds without a sharp corner
        self.run_length = np.bincount(run, track.length).astype(float)[self.run]  # mm


def _directions(track: Track, feeds: Bools, piece: Ints, w: Floats) -> Floats:
    """Unit directions of the feed (k, 3), without a jump where pieces go on from each other."""
    first, last = _ends(track)
    more0, more1 = np.zeros_like(first), np.zeros_like(last)
    real = np.flatnonzero(feeds)
    a, b = real[:-1], real[1:]
    joined = ~track.corner[b]
    a, b = a[joined], b[joined]
    both = last[a] + first[b]
    both /= np.maximum(np.linalg.norm(both, axis=1, keepdims=True), 1e-300)
    more1[a], more0[b] = both - last[a], both - first[b]
    u = np.clip(track.u(piece, w), (track.u0 + track.beside0)[piece], (track.u1 - track.beside1)[piece])
    out = path_geometry.tangents(track.path, track.motion[piece], u)
    return _unit(out + (1.0 - w)[:, None] * more0[piece] + w[:, None] * more1[piece])


def _ends(track: Track) -> tuple[Floats, Floats]:
    """Directions (p, 3) at both ends of all pieces."""
    first = path_geometry.tangents(track.path, track.motion, track.u0 + track.beside0)
    return first, path_geometry.tangents(track.path, track.motion, track.u1 - track.beside1)


def _unit(vectors: Floats) -> Floats:
    size = np.linalg.norm(vectors, axis=1, keepdims=True)
    out: Floats = np.divide(vectors, size, out=np.zeros_like(vectors), where=size > 0.0)
    return out


def _runs(track: Track, feeds: Bools) -> Ints:
    """Number (p,) of the run of every piece: feeds that go on from each other with no sharp corner."""
    first, last = _ends(track)
    real = np.flatnonzero(track.length > 0.0)
    begins = np.ones(len(track.motion), np.bool_)
    a, b = real[:-1], real[1:]
    begins[b] = ~(feeds[a] & feeds[b]) | (np.sum(last[a] * first[b], axis=1) < np.cos(SHARP))
    begins[np.setdiff1d(np.arange(len(begins)), real)] = False
    return np.cumsum(begins)


@dataclass(frozen=True, eq=False, kw_only=True)
class _Leading:
    """A tip that is led through the stock; at nodes (k,) it lies at free + slope @ force."""

    memory: StockMemory
    track: Track
    way: Way
    free: Floats  # (k, 3) mm
    slope: Floats  # (k, 3, 3) mm/N
    reach: float  # mm

    def run(self) -> tuple[Floats, Floats]:
        """Lead the tip: forces (k, 3) N at the nodes, and the imbalance (mm) where they were sought.

        A force changes as the tool goes on, and it takes about as much way as the tool is bent: behind a sharp corner the tip
        goes straight to where it is bent for the new direction, and so it does over runs shorter than `reach` between two
        sharp corners, by which corrected lines are joined. Where such runs lead elsewhere, the tip first goes there.
        """
        way, free, slope, n = self.way, self.free, self.slope, len(self.way.piece)
        tool = self.track.path.tool[self.track.motion[way.piece]]
        force, unrest = np.zeros((n, 3)), list[float]()
        at, begin, skipped = free[0] if n else np.zeros(3), 0.0, False
        bend: list[tuple[float, Floats]] = []  # way and bend at the nodes of this run
        for k in range(n):
            before = force[max(k - 1, 0)]
            if k == 0 or way.run[k] != way.run[k - 1]:
                begin, goes_on = way.s[k], k > 0 and way.feeds[k - 1] and way.feeds[k]
                rest = FARTHER * float(np.linalg.norm(at - way.told[k])) if goes_on else 0.0
                short = goes_on and way.run_length[k] < self.reach
                if skipped and not short and way.loads[k]:
                    there = free[k] + slope[k] @ self._at_rest(k, before, [])[0]
                    if np.linalg.norm(there - at) > REAL * np.linalg.norm(
                        way.told[k] - at
                    ):  # not joined where it stood
                        self.memory.take(at, there, int(tool[k]), self.reach)
                        at, rest = there, 0.0
                skipped = short
                rest = np.inf if short else rest
                bend = []
            if way.s[k] - begin < rest or (bend and way.s[k] == bend[-1][0]):
                force[k] = before
                continue
            if way.loads[k]:
                force[k], left = self._at_rest(k, before, bend)
                unrest.append(left)
            elif way.feeds[k]:
                force[k] = way.fixed[k]
            tip = free[k] + slope[k] @ force[k]
            if way.feeds[k]:
                self.memory.take(at, tip, int(tool[k]), self.reach)
            bend.append((way.s[k], tip - way.told[k]))
            at = tip
            if k % 256 == 0:
                done(k / n)
        return force, np.array(unrest)

    def _at_rest(self, k: int, start: Floats, bend: list[tuple[float, Floats]]) -> tuple[Floats, float]:
        """Solve force (3,) N and tip at node k together; return the force and the imbalance of the tip, mm.

        The tool advances where its tip does: along the program's direction and as its bend changes.

        Steps towards the force found are as long as the last two let hope (Aitken): where the tool begins to touch, the arc
        grows with the square root of the way, and full steps would go to and fro for ever.
        """
        track, way, free, slope = self.track, self.way, self.free[k], self.slope[k]
        piece, w = way.piece[k : k + 1], way.w[k : k + 1]
        tool, behind = int(track.path.tool[track.motion[piece[0]]]), _behind(bend)
        force, share, before = start, 1.0, None
        for _ in range(TRIES):
            tip, direction = free + slope @ force, way.direction[k]
            if behind is not None:
                direction = direction + (tip - way.told[k] - behind[1]) / (way.s[k] - behind[0])
                direction = direction / np.linalg.norm(direction)
            depth, arcs = self.memory.meet(tip, direction, tool)
            found = np.zeros(3)
            if len(arcs.start):
                found = way.fixed[k]
                if not track.conditions.plunges:
                    found = track.force_meeting(piece, w, direction[None], np.array([depth]), arcs)[0]
            step = found - force
            left = float(np.abs(slope @ step).max())
            if left < REST_MM:
                return found, 0.0
            if before is not None:
                change = step - before
                share = float(
                    np.clip(-share * (before @ change) / max(float(change @ change), 1e-30), LEAST_SHARE, 1.0)
                )
            force, before = force + share * step, step
        return force, left


def _behind(bend: list[tuple[float, Floats]]) -> tuple[float, Floats] | None:
    """Way and bend on this run from where on its change is taken: over so much way that it turns the feed by little."""
    if bend:
        far = bend[-1][0] - max(BASE_MM, FARTHER * float(np.linalg.norm(bend[-1][1])))
        for each in reversed(bend):
            if each[0] <= far:
                return each
    return None
