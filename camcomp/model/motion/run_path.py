"""One run as the twin sees it: where the set-points are in time, and where in the program every row of a log stands."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from camcomp.ground import path_geometry
from camcomp.ground.datatypes import Floats
from camcomp.model.cutting.track import Track
from camcomp.model.hysteresis import direction
from camcomp.model.motion.node_pieces import NODES, Pieces, Places, cut
from camcomp.model.motion.timeline import Timeline

STEP_S = 0.001  # grid of what has memory: 0.2 um of interpolation at 1500 mm/s2
MOST_STEPS = 40000
ABRUPT_S = (
    0.010  # clocks of logs, the lag of a control and the build-up of a chip: a jump of the force is no better known
)
_MOST = 0.1  # of a run's rows; those of grooves are one in a hundred
_JUMP_N = 0.1  # of the largest force in the run; the turn of an arc or of a fine polygon stays beneath


@dataclass(frozen=True, eq=False)
class RunPath:
    """A run's set-points and nodes. n rows, q nodes, g instants of a fine time grid, m actuators.

    Everything that needs inverse kinematics is computed once, when the run_path is made.
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
    grid_cut: Floats  # (g,) 1 where the model cuts
    grid_piece: np.ndarray  # (g,) piece
    pieces: int
    place: Callable[[Floats], Places]  # times (n,) -> where they lie between the nodes
    row_rho: Floats  # (n, m) set-points at the rows
    temperature: Floats | None  # (n,) deg C at the rows
    timeline: Timeline | None
    cut_before_min: float = 0.0

    @cached_property
    def row_place(self) -> Places:
        """Where the rows lie between the nodes."""
        return self.place(self.time)

    @cached_property
    def row_force(self) -> Floats:
        """Cutting force (n, 3) N at the rows, machine frame, as modelled."""
        return self.row_place.of(self.node_force)

    @property
    def cut_min(self) -> float:
        """Minutes of cutting in this run."""
        dt = np.diff(self.grid, prepend=self.grid[:1])
        return float((dt * self.grid_cut).sum() / 60.0)


def beside_jumps(run_path: RunPath) -> NDArray[np.bool_]:
    """Rows (n,) within ABRUPT_S of an instant at which the modelled force jumps (corner, entry, exit).

    On which side of the jump such a row was taken nobody knows, and the machine springs by up to a millimetre there. None
    where they are too many: short lines with corners between them leave no other rows to judge by.
    """
    near = np.zeros(len(run_path.time), dtype=bool)
    size = np.linalg.norm(run_path.node_force, axis=1).max(initial=0.0)
    if not run_path.ordered or size == 0.0:
        return near
    before = np.concatenate(
        [np.zeros((1, 3)), run_path.node_force[NODES - 1 :: NODES]]
    )  # the machine is idle before and after
    after = np.concatenate([run_path.node_force[::NODES], np.zeros((1, 3))])
    start = np.append(run_path.node_time[::NODES], run_path.node_time[-1])
    at = np.sort(start[np.linalg.norm(after - before, axis=1) > _JUMP_N * size])
    found = np.searchsorted(at, run_path.time - ABRUPT_S) < np.searchsorted(at, run_path.time + ABRUPT_S, side="right")
    return found if found.mean() < _MOST else near


def path_of_program(
    name: str,
    timeline: Timeline,
    track: Track,
    time: Floats,
    *,
    started: float,
    to_machine: Callable[[Floats], Floats],
    vectors: Callable[[Floats], Floats],
    inverse: Callable[[Floats], Floats],
    setpoints: Floats | None = None,
    temperature: Floats | None = None,
) -> RunPath:
    """RunPath of a program's feed motions, whose loads are those of `track`.

    to_machine: tips (q, 3) program -> machine frame; vectors: the same for vectors. inverse: machine tips (q, 3) ->
    set-points (q, m). setpoints (n, m): as logged, instead of computed.
    """
    rank = np.full(len(timeline.path), -1)
    rank[timeline.index] = np.arange(len(timeline.index))
    own = np.flatnonzero((rank[track.motion] >= 0) & (track.length > 0.0))
    part, u0, u1 = cut(timeline.path, track.motion[own], track.u0[own], track.u1[own], track.length[own])
    pieces = Pieces(rank[track.motion[own]][part], u0, u1)
    piece, w = pieces.nodes()
    share = pieces.share(piece, w)
    tip = to_machine(path_geometry.points(timeline.path, timeline.index[pieces.motion[piece]], share))
    rho = inverse(tip)
    of_track = own[part][piece]
    within = (share - track.u0[of_track]) / (track.u1[of_track] - track.u0[of_track])
    load = vectors(track.force(of_track, np.clip(within, 0.0, 1.0)))

    def place(at: Floats) -> Places:
        return pieces.at(*timeline.locate(at))

    first, last = min(0.0, float(time.min(initial=0.0))), max(timeline.end, float(time.max(initial=0.0)))
    steps = int(min(np.ceil((last - first) / STEP_S) + 1, MOST_STEPS))
    grid = np.linspace(first, last, max(steps, 2))
    where = place(grid)
    grid_rho = where.of(rho)
    row_rho = place(time).of(rho)
    if setpoints is not None:
        ahead = np.where(np.isfinite(setpoints), setpoints - row_rho, 0.0)
        row_rho = row_rho + ahead
        grid_rho = grid_rho + np.column_stack([np.interp(grid, time, each) for each in ahead.T])
    grid_cut = (np.abs(where.of(load)).sum(axis=1) > 1e-9).astype(float)
    grid_cut[(grid < 0.0) | (grid > timeline.end)] = 0.0
    return RunPath(
        name, time, started, True, tip, load, rho, _node_times(timeline, pieces.motion[piece], share), grid, grid_rho, grid_cut,
        where.piece, len(pieces.motion), place, row_rho, temperature, timeline,
    )  # fmt: skip


def _node_times(timeline: Timeline, k: np.ndarray, share: Floats) -> Floats:
    """Time (q,) at which motion k (q,) has done a share (q,); the trapezoid turned round on a table."""
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
