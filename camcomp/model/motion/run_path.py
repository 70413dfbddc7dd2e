"""Run path of the twin: set-points of one run over time, and the positions of log rows between its nodes."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from camcomp.ground import path_geometry
from camcomp.ground.compiled import kept
from camcomp.ground.datatypes import Bools, Floats, Ints
from camcomp.ground.records import dataclass, replace
from camcomp.model.cutting.track import Track
from camcomp.model.hysteresis import direction
from camcomp.model.motion.node_pieces import Pieces, Places, cut
from camcomp.model.motion.timeline import Timeline
from camcomp.model.seams import Seams

if TYPE_CHECKING:
    from camcomp.model.motion.control_kinematics import ControlKinematics

STEP_S = 0.001  # time grid of elements with memory: 0.2 um of interpolation error at 1500 mm/s2
MOST_STEPS = 40000
_IN_DOUBT = 0.05  # of the largest force: error bound from which a row is uncertain
MOVES_S = 0.05  # half width of the window in which a motion is distinguished from noise
STANDS_MM_PER_S = 0.05  # speed below which the tip is at standstill
_HARDLY_OTHERS = 0.8  # share of uncertain rows from which they are used all the same
_UNEVEN = 1e-3  # of the largest force: error of the interpolated force from which a node is added
_FEW = 0.5  # of the grid: share of instants below which a selection is worth its cost


@dataclass(frozen=True, eq=False)
class Driven:
    """Data of a logged run at its rows, machine frame.

    tip (n, 3) mm: nominal tip of the set-points; force (n, 3) N; doubt (n, 3) N: half the width of its error interval; lead:
    times (k,) -> nominal tips (k, 3); seams: starts and continuations of the recording on the grid.
    """

    tip: Floats
    force: Floats
    doubt: Floats
    lead: Callable[[Floats], Floats]
    seams: Seams


@dataclass(frozen=True, eq=False, kw_only=True)
class RunPath:
    """Set-points and nodes of a run: n rows, q nodes, g instants of a fine time grid, m actuators.

    All inverse kinematics are computed once, when the run path is built.
    """

    name: str
    time: Floats  # (n,) s of the rows
    started: float  # s on the common clock
    ordered: bool
    node_tip: Floats  # (q, 3) mm machine frame
    node_force: Floats  # (q, 3) N machine frame, as modelled
    node_rho: Floats  # (q, m) set-points
    node_time: Floats  # (q,) s
    grid: Floats  # (g,) s
    grid_rho: Floats  # (g, m) set-points
    grid_cut: Floats  # (g,) 1 where the model cuts and the tool moves
    grid_piece: np.ndarray  # (g,) piece
    pieces: int
    place: Callable[[Floats], Places]  # times (n,) -> interpolation between the nodes
    row_rho: Floats  # (n, m) set-points at the rows
    temperature: Floats | None  # (n,) deg C at the rows
    driven: Driven | None = None
    feed_mm_per_min: float = np.nan  # median of the program
    cut_before_min: float = 0.0  # in earlier runs
    cut_ahead_min: float = 0.0  # by the program in this run, before its log begins
    node_rotation: Floats | None = (
        None  # (q, 3, 3) of the platform, machine frame; None: the one that the machine holds
    )
    clock_s: float = 0.0  # known lag of the clock of the tip
    between_s: float = 0.0  # estimated offset of the tip readings from the instants of the rows
    told: bool = False  # forces are those at the set-points, so that a lag of the loop delays them too
    led: bool = False  # the motion is that of the measured tip, which then has no clock offset
    measured_force: bool = False  # forces are those of a table or a dynamometer

    @cached_property
    def tip_time(self) -> Floats:
        """Times (n,) s of the tip readings of the rows, corrected by the known offsets of their clock."""
        return self.time - self.clock_s if self.clock_s else self.time

    @cached_property
    def _rows_in_grid(self) -> tuple[Ints, Floats]:
        return self._between_instants(self.time)

    def in_grid(self, at: Floats) -> tuple[Ints, Floats]:
        """Position of times (n,) on the grid: index (n,) of the instant before, and share (n, 1) of the step."""
        return self._rows_in_grid if at is self.time else self._between_instants(at)

    def between(self, values: Floats, at: Floats) -> Floats:
        """Grid values (g, c) interpolated to times (n,); rows of unordered poses are the grid itself."""
        if not self.ordered:
            return values
        i, u = self.in_grid(at)
        out = np.empty((len(i), values.shape[1]))
        _between(np.ascontiguousarray(values), i, u, out)
        return out

    def _between_instants(self, at: Floats) -> tuple[Ints, Floats]:
        i = np.clip(np.searchsorted(self.grid, at, side="right") - 1, 0, len(self.grid) - 2)
        step = self.grid[i + 1] - self.grid[i]
        return i, np.clip((at - self.grid[i]) / np.where(step > 0, step, 1.0), 0.0, 1.0)[:, None]

    @cached_property
    def near_rows(self) -> Ints:
        """Instants of the grid next to the rows and their tip readings."""
        before = np.concatenate([self.in_grid(self.time)[0], self.in_grid(self.tip_time)[0]])
        return np.unique(np.concatenate([before, before + 1]))

    @cached_property
    def around_rows(self) -> RunPath:
        """This run reduced to the instants `near_rows`; unchanged where they are most of the grid."""
        if not self.ordered or len(self.near_rows) > _FEW * len(self.grid):
            return self
        grid = {each: getattr(self, each)[self.near_rows] for each in ("grid", "grid_rho", "grid_cut", "grid_piece")}
        return replace(self, **grid)

    @cached_property
    def row_place(self) -> Places:
        """Interpolation between the nodes at the rows."""
        return self.place(self.time)

    @cached_property
    def grid_place(self) -> Places:
        """Interpolation between the nodes at the instants of the grid."""
        return self.place(self.grid)

    @cached_property
    def tip_place(self) -> Places:
        """Interpolation between the nodes at the tip readings of the rows."""
        return self.place(self.tip_time) if self.clock_s else self.row_place

    @cached_property
    def row_force(self) -> Floats:
        """Cutting force (n, 3) N at the rows, machine frame, as modelled."""
        return self.row_place.of(self.node_force) if self.driven is None else self.driven.force

    @cached_property
    def node_piece(self) -> Ints:
        """Piece (q,) of every node."""
        return np.arange(len(self.node_tip)) // max(len(self.node_tip) // max(self.pieces, 1), 1)

    @cached_property
    def uneven(self) -> Ints:
        """Middle node of every piece whose interpolated force differs from the force at its rows."""
        if self.driven is None:
            return np.zeros(0, np.int64)
        off = np.abs(self.row_force - self.row_place.of(self.node_force)).max(axis=1)
        pieces = np.unique(self.row_place.piece[off > _UNEVEN * float(np.abs(self.row_force).max(initial=0.0))])
        return np.asarray(np.searchsorted(self.node_piece, pieces) + len(self.node_tip) // max(self.pieces, 1) // 2)

    def forces(self, place: Places) -> Floats:
        """Cutting force (n, 3) N, machine frame, at an interpolation `place` close to that of the rows."""
        found = place.of(self.node_force)
        return found if self.driven is None else found + self.row_force - self.row_place.of(self.node_force)

    def tips(self, at_nodes: Floats, place: Places, at: Floats) -> Floats:
        """Loaded tips (n, 3), machine frame, at times (n,) from those at the nodes (q, 3).

        Along a program the tips are interpolated; for a logged run only the deflection is.
        """
        if self.driven is None:
            return place.of(at_nodes)
        nominal = self._row_tip if at is self.tip_time else self.driven.lead(at)
        return np.asarray(nominal + place.of(at_nodes - self.node_tip))

    @cached_property
    def _row_tip(self) -> Floats:
        assert self.driven is not None
        return self.driven.lead(self.tip_time) if self.clock_s else self.driven.tip

    @cached_property
    def jumping(self) -> Bools:
        """Mask (n,) of rows with an unknown side of a force jump, where the tip springs.

        All false where hardly any other rows cut, because these rows then are the only evidence of the run.
        """
        if self.driven is None:
            return np.zeros(len(self.time), bool)
        size = np.linalg.norm(self.driven.force, axis=1)
        doubtful = np.linalg.norm(self.driven.doubt, axis=1) > max(_IN_DOUBT * float(size.max(initial=0.0)), 1e-9)
        cutting = size > 0.0
        if doubtful[cutting].sum() > _HARDLY_OTHERS * cutting.sum():
            return np.zeros(len(self.time), bool)
        return np.asarray(doubtful)

    @property
    def cut_min(self) -> float:
        """Minutes of cutting in this run."""
        dt = np.diff(self.grid, prepend=self.grid[:1])
        return float((dt * self.grid_cut).sum() / 60.0)


@kept
def _between(values, before, share, out):  # type: ignore[no-untyped-def]  # pragma: no cover
    for t in range(len(before)):
        i, u = before[t], share[t, 0]
        for j in range(out.shape[1]):
            out[t, j] = (1.0 - u) * values[i, j] + u * values[i + 1, j]


def path_of_program(
    machine: ControlKinematics,
    name: str,
    timeline: Timeline,
    track: Track,
    time: Floats,
    *,
    started: float,
    temperature: Floats | None = None,
) -> RunPath:
    """Run path of a program's feed motions on its own timeline, with the loads of `track`."""
    rank = np.full(len(timeline.path), -1)
    rank[timeline.index] = np.arange(len(timeline.index))
    own = np.flatnonzero((rank[track.motion] >= 0) & (track.length > 0.0))
    part, u0, u1 = cut(timeline.path, track.motion[own], track.u0[own], track.u1[own], track.length[own])
    pieces = Pieces(rank[track.motion[own]][part], u0, u1)
    piece, w = pieces.nodes()
    share = pieces.share(piece, w)
    motion = timeline.index[pieces.motion[piece]]
    tip = machine.to_machine(path_geometry.points(timeline.path, motion, share))
    rotation = machine.platform(timeline.path, motion, share)
    rho = machine.inverse(tip, rotation)
    of_track = own[part][piece]
    within = (share - track.u0[of_track]) / (track.u1[of_track] - track.u0[of_track])
    load = machine.vectors(track.force(of_track, np.clip(within, 0.0, 1.0)))

    def place(at: Floats) -> Places:
        return pieces.at(*timeline.locate(at))

    first, last = min(0.0, float(time.min(initial=0.0))), max(timeline.end, float(time.max(initial=0.0)))
    steps = int(min(np.ceil((last - first) / STEP_S) + 1, MOST_STEPS))
    grid = np.linspace(first, last, max(steps, 2))
    where = place(grid)
    grid_rho = where.of(rho)
    row_rho = place(time).of(rho)
    grid_cut = (np.abs(where.of(load)).sum(axis=1) > 1e-9) * moving(grid, where.of(tip))
    grid_cut[(grid < 0.0) | (grid > timeline.end)] = 0.0
    return RunPath(
        name=name,
        time=time,
        started=started,
        ordered=True,
        node_tip=tip,
        node_force=load,
        node_rho=rho,
        node_time=_node_times(timeline, pieces.motion[piece], share),
        grid=grid,
        grid_rho=grid_rho,
        grid_cut=grid_cut,
        grid_piece=where.piece,
        pieces=len(pieces.motion),
        place=place,
        row_rho=row_rho,
        temperature=temperature,
        node_rotation=rotation,
        feed_mm_per_min=60.0 * float(np.median(timeline.feed)),
    )


def moving(time: Floats, tip: Floats) -> Floats:
    """1 where a tip (n, 3) mm moves at times (n,) s, 0 at standstill, which does not wear the tool."""
    if len(time) < 2:
        return np.zeros(len(time))
    around = [np.clip(time + d, time[0], time[-1]) for d in (-MOVES_S, MOVES_S)]
    before, after = (np.column_stack([np.interp(at, time, v) for v in tip.T]) for at in around)
    speed = np.linalg.norm(after - before, axis=1) / (around[1] - around[0])
    return np.asarray(speed > STANDS_MM_PER_S, float)


def _node_times(timeline: Timeline, k: np.ndarray, share: Floats) -> Floats:
    """Time (q,) s at which motion k (q,) reaches a share (q,) of its length: inverse of the trapezoid, by table."""
    table = np.linspace(0.0, 1.0, 201)
    out = np.empty(len(k))
    for motion in np.unique(k):
        at = timeline.start[motion] + table * timeline.duration[motion]
        done = timeline.share(np.full(len(at), motion), at)
        mine = k == motion
        out[mine] = np.interp(share[mine], done, at)
    return out


def travel_direction(run_path: RunPath, encoder: Floats) -> Floats:
    """Direction of travel with memory (g, m) of encoders on the fine grid (g, m); zero for unordered poses."""
    return direction(encoder) if run_path.ordered else np.zeros_like(encoder)
