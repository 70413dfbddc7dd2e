"""The reference Orthoglide in time: what its tip, encoders and drives do while a program runs, with anything wrong with it.

Chain of causes, each at its place and each with its own sign (this is the documentation of the truth):

    set-point c    inverse kinematics of the programmed tip with the *nominal* machine and tool
    encoder e      c through a second-order servo; delay lag_ms: e(t) ~ c(t - lag)
    carriage       e + pitch_ppm 1e-6 (e + 300) + cyclic sin(2 pi e / cyclic_pitch + phase) + offset + growth (T - 20)
                   with e replaced by the position behind the play; all "carriage minus encoder" are positive along +
    friction f     opposes the carriage; moves it by -f/k through the drive spring and adds +f to the drive force
    structure      minimum of the energy at those motor positions under the cutting force and the weight
    tip            + deflection * lateral force (same direction as the force acts)
    workpiece      measured tip = Rz(-rotation) (machine tip - origin - shift): the clamped workpiece sits at `shift`
    clock          a row stamped t holds the tip of controller time t - sync: the tip's clock is late by sync

Drive force: what the drive exerts on its carriage, positive along +, so a load that pushes along + reads negative.
Foreign effects, which no library has, hook in through tests.validation.plants.unmodelled.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.spatial import cKDTree

from tests.validation.plants import drives, energy, unmodelled
from tests.validation.plants.legs import Legs, orthoglide
from tests.validation.plants.motion import Timeline

ORIGIN = np.array([-73.205, -73.205, -173.205])  # program origin in the machine frame
TRIPLE = np.array([215.0, -10.0, -25.0])  # force on the tool: right of the feed, along it, along the tool axis
HOME = -300.0


def _zeros() -> np.ndarray:
    return np.zeros(3)


@dataclass(frozen=True)
class Truth:
    """Faults of the machine; arrays are per actuator x, y, z.  The default is the perfect machine."""

    lag_ms: np.ndarray = field(default_factory=_zeros)
    play_mm: np.ndarray = field(default_factory=_zeros)
    friction_N: np.ndarray = field(default_factory=_zeros)
    offset_mm: np.ndarray = field(default_factory=_zeros)
    pitch_ppm: np.ndarray = field(default_factory=_zeros)
    cyclic_mm: np.ndarray = field(default_factory=_zeros)
    cyclic_pitch_mm: np.ndarray = field(default_factory=lambda: np.full(3, 5.0))
    cyclic_phase: np.ndarray = field(default_factory=_zeros)
    growth_mm_per_K: np.ndarray = field(default_factory=_zeros)
    drive_factor: np.ndarray = field(default_factory=lambda: np.ones(3))
    link_factor: float = 1.0
    roll_deg: np.ndarray = field(default_factory=_zeros)
    longer_mm: np.ndarray = field(default_factory=_zeros)
    weight_N: float = 0.0
    force_factor: float = 1.0
    wear_per_min: float = 0.0
    tool_mm: float = 0.0
    deflection_mm_per_N: float = 0.0
    shift_mm: np.ndarray = field(default_factory=_zeros)
    rotation_deg: float = 0.0
    sync_s: float = 0.0
    # character of the machine, no errors in themselves
    damping: float = 0.8
    slip_mm: float = 0.008
    play_start: np.ndarray = field(default_factory=_zeros)
    heat_K: tuple[float, float] = (3.0, 5.0)
    heat_taus_s: tuple[float, float] = (260.0, 1700.0)
    foreign: tuple[tuple[str, dict], ...] = ()

    def legs(self) -> Legs:
        """The structure as it really is (its tool too)."""
        return orthoglide(
            tool=100.0 + self.tool_mm,
            roll_deg=tuple(self.roll_deg),
            longer=tuple(self.longer_mm),
            drive_factor=tuple(self.drive_factor),
            link_factor=self.link_factor,
        )


@dataclass(frozen=True)
class Run:
    """One executed program on the common clock; cut_before: minutes of cutting done by earlier runs.

    surface: the program that was corrected, when the executed one is its correction: where the tool cuts, and which way
    the cutting force points, is a matter of the groove, not of the chords which lead the drives there.
    """

    timeline: Timeline
    cutting: bool
    started_s: float
    cut_before_min: float = 0.0
    surface: Timeline | None = None


@dataclass
class State:
    """Everything known about one run at the times t (controller clock); foreign effects may change fields marked *."""

    t: np.ndarray
    common: np.ndarray  # t on the common clock, s
    programmed: np.ndarray  # (n, 3) tip, program frame
    along: np.ndarray  # (n, 3) unit feed direction
    speed: np.ndarray  # (n,) mm/s
    line: np.ndarray
    cuts: np.ndarray  # (n,) bool, force on
    setpoint: np.ndarray  # (n, 3)
    encoder: np.ndarray  # (n, 3) *
    carriage: np.ndarray  # (n, 3) motor side of the drive spring *
    velocity: np.ndarray  # (n, 3) of the set-points
    temperature: np.ndarray  # (n,) deg C at the sensor
    force: np.ndarray  # (n, 3) machine frame *
    drive: np.ndarray  # (n, 3) *
    tip: np.ndarray  # (n, 3) program frame, without sensor errors *


_NOMINAL = orthoglide()


def _setpoints(timeline: Timeline, t: np.ndarray) -> np.ndarray:
    return energy.inverse(_NOMINAL, timeline.sample(t)["tip"] + ORIGIN)


def _cut_minutes(run: Run, t: np.ndarray) -> np.ndarray:
    grid = np.arange(0.0, max(float(np.max(t)), 0.0) + 0.1, 0.05)
    done = np.concatenate([[0.0], np.cumsum(run.timeline.sample(grid)["cuts"][:-1] * 0.05)]) / 60
    return run.cut_before_min + np.interp(t, grid, done)


def _groove(surface: Timeline, tip: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Feed direction (n, 3) of the surface at its points nearest to tip (n, 3), and whether it is cut there (n,)."""
    dense = surface.sample(np.linspace(0.0, surface.log_end, 20001)[1:-1])
    nearest = cKDTree(dense["tip"]).query(tip)[1]
    return dense["along"][nearest], dense["cuts"][nearest]


def simulate(
    run: Run,
    truth: Truth,
    t: np.ndarray,
    busy: list[tuple[float, float]],
    cutting_at: np.ndarray | None = None,
) -> State:
    """The run at controller times t (n,), noise-free; busy: intervals of the common clock in which the machine moves.

    cutting_at: for a run with a surface, where the tool is known to cut (n, 3); found here when it is missing.
    """
    if run.surface is not None and cutting_at is None:
        for _ in range(2):  # where the tool cuts decides the force, and the force moves the tool
            cutting_at = simulate(
                run, truth, t, busy, run.timeline.sample(t)["tip"] if cutting_at is None else cutting_at
            ).tip
    legs, line = truth.legs(), run.timeline
    grid = np.arange(line.begin[0], line.log_end + 0.1, drives.STEP)
    c = _setpoints(line, grid)
    e = c + np.stack([drives.servo_error(c[:, i], truth.lag_ms[i], truth.damping) for i in range(3)], 1)
    for name, size in truth.foreign:
        e = e + unmodelled.at_encoder(name, size, grid, run, c)
    behind = np.stack([drives.play(e[:, i], truth.play_mm[i], truth.play_start[i]) for i in range(3)], 1)

    def on_grid(values: np.ndarray) -> np.ndarray:
        return np.stack([np.interp(t, grid, values[:, i]) for i in range(3)], 1)

    here = line.sample(t)
    setpoint = energy.inverse(_NOMINAL, here["tip"] + ORIGIN)
    encoder = setpoint + on_grid(e - c)
    nut = encoder + on_grid(behind - e)
    common = run.started_s + t
    heat = drives.warming(common, busy, truth.heat_K, truth.heat_taus_s)
    warm = 0.85 * heat[:, 0] + 0.15 * heat[:, 1]
    late = drives.warming(common - 4.0, busy, truth.heat_K, truth.heat_taus_s)  # the sensor sits in a bore
    cyclic = np.sin(2 * np.pi * nut / truth.cyclic_pitch_mm + truth.cyclic_phase)
    carriage = nut + truth.pitch_ppm * 1e-6 * (nut - HOME) + truth.cyclic_mm * cyclic + truth.offset_mm
    carriage = carriage + truth.growth_mm_per_K * warm[:, None]

    along, cuts = here["along"], here["cuts"]
    if run.surface is not None and cutting_at is not None:
        along, cuts = _groove(run.surface, cutting_at)
        cuts &= here["feeds"]
    cuts = cuts & run.cutting
    right = np.cross(along, [0.0, 0.0, 1.0])
    size = truth.force_factor * (1 + truth.wear_per_min * _cut_minutes(run, t)) * cuts
    force = size[:, None] * (right * TRIPLE[0] + along * TRIPLE[1] + np.array([0, 0, TRIPLE[2]]))
    velocity = (_setpoints(line, t + 1e-4) - _setpoints(line, t - 1e-4)) / 2e-4
    state = State(
        t, common, here["tip"], here["along"], here["speed"], here["line"], cuts, setpoint, encoder, carriage,
        velocity, 20.0 + late @ [0.85, 0.15], force, np.zeros((len(t), 3)), np.zeros((len(t), 3)),
    )  # fmt: skip
    for name, values in truth.foreign:
        unmodelled.at_carriage(name, values, state)

    friction = np.zeros((len(t), 3))
    if np.any(truth.friction_N > 0):
        pulled = energy.settle(legs, state.carriage, state.force, weight=truth.weight_N).drive
        stiff = 1e4 * truth.drive_factor
        where = behind + _fine(grid, t, state.carriage - nut - pulled / stiff)
        friction = on_grid(
            np.stack([_friction(where[:, i], truth.friction_N[i], truth.slip_mm, stiff[i]) for i in range(3)], 1)
        )
        state.carriage = state.carriage - friction / stiff
    found = energy.settle(legs, state.carriage, state.force, weight=truth.weight_N)
    state.drive = found.drive + friction
    lateral = state.force * [1.0, 1.0, 0.0]
    tip = found.tip + truth.deflection_mm_per_N * lateral - ORIGIN - truth.shift_mm
    angle = np.deg2rad(truth.rotation_deg)
    turn = np.array([[np.cos(angle), np.sin(angle), 0], [-np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    state.tip = tip @ turn.T
    for name, values in truth.foreign:
        unmodelled.at_tip(name, values, state)
    return state


def _fine(grid: np.ndarray, t: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Values (n, 3) known at t, held and interpolated on the fine grid."""
    return np.stack([np.interp(grid, t, values[:, i]) for i in range(3)], 1)


def _friction(x: np.ndarray, limit: float, slip: float, spring: float) -> np.ndarray:
    return drives.slip_blocks(np.ascontiguousarray(x), limit, slip, spring) if limit > 0 else np.zeros(len(x))


def observe(run: Run, truth: Truth, t: np.ndarray, busy: list[tuple[float, float]]) -> State:
    """As `simulate`, but the tip is the one of controller time t - sync: what the two clocks make of it."""
    state = simulate(run, truth, t, busy)
    if truth.sync_s != 0.0:
        state.tip = simulate(run, truth, t - truth.sync_s, busy).tip
    return state
