"""The one forward model: set-points in time -> control -> drive -> structure -> tool -> workpiece -> sensor.

simulate prints it, diagnose compares it with logs, compensate inverts it. Effects act at fixed hooks in this order and
nowhere else. The loaded equilibrium is solved at the nodes of a run path; between them, and for small differences, its
first derivatives carry on.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from camcomp.ground.datatypes import Floats
from camcomp.ground.errors import PhysicsError
from camcomp.model.effect import Cause, Load, Motion, driven
from camcomp.model.job import Job
from camcomp.model.motion.node_pieces import Places
from camcomp.model.motion.run_path import RunPath, travel_direction
from camcomp.model.statics.description import Robot
from camcomp.model.statics.machine import Machine, build_machine
from camcomp.model.statics.solve import FREE, STATUS, solve

_RHO_STEP = 1e-3  # mm or 1e-3 mrad of drive, to first order linear within 1e-6
_FORCE_STEP = 1.0  # N
_SLOPES = ("tip_rho", "tip_wrench", "drive_rho", "drive_wrench")
_MOMENT_STEP = 100.0  # N mm
_SAME_LOAD = 1e-3  # share of the load by which a changed machine's may differ from that it was solved with


@dataclass(frozen=True, eq=False)
class Reading:
    """What the sensors show in n rows: tip (n, 3) mm program frame, encoder (n, m), drive (n, m) N, dyno (n, 3) N."""

    tip: Floats
    encoder: Floats
    drive: Floats
    dyno: Floats
    motion: Motion


@dataclass(frozen=True, eq=False)
class Solved:
    """The structure at a run path's nodes, for the drive positions and loads it was solved with."""

    key: tuple[Any, ...]
    shift: Floats  # (pieces, m) carriage minus set-point, piece by piece
    force: Floats  # (q, 3)
    wrench: Floats  # (q, 6)
    tip: Floats  # (q, 3) machine frame
    drive: Floats  # (q, m)


@dataclass(frozen=True, eq=False)
class Slopes:
    """First derivatives at the nodes: of tip and drive force by carriage (q, ., m) and by wrench at the reference (q, ., 6)."""

    tip_rho: Floats
    tip_wrench: Floats
    drive_rho: Floats
    drive_wrench: Floats


@dataclass(frozen=True, eq=False)
class Twin:
    """A machine under judgement. origin (3,), rotation (3, 3): program frame in the machine frame."""

    robot: Robot
    nominal: Robot
    origin: Floats
    rotation: Floats
    causes: tuple[Cause, ...] = ()
    machines: dict[tuple[Any, ...], Machine] = field(default_factory=dict)

    @property
    def actuators(self) -> tuple[str, ...]:
        """Names in the order of every actuator array."""
        return tuple(each.name for each in self.robot.actuators)

    def to_machine(self, tip: Floats) -> Floats:
        """Tips (n, 3) program -> machine frame."""
        return self.origin + tip @ self.rotation.T

    def to_program(self, tip: Floats) -> Floats:
        """Tips (n, 3) machine -> program frame."""
        return (tip - self.origin) @ self.rotation

    def inverse(self, tip: Floats) -> Floats:
        """Set-points (n, m) that the control computes for machine tips (n, 3). Raises PhysicsError CC301."""
        machine = build_machine(self.nominal, self.nominal)
        state = solve(machine, FREE, tip, check=False)
        if (state.status == 3).any():
            bad = int(np.argmax(state.status == 3))
            raise PhysicsError("CC410", f"tip {np.round(tip[bad], 3).tolist()} (machine frame) is {STATUS[3]}")
        return state.rho_nominal

    def edited(self, causes: Sequence[Cause]) -> tuple[Robot, tuple[Any, ...]]:
        """The machine with the effects on it, and a key that tells equal ones."""
        robot, key = self.robot, []
        for cause in causes:
            hook = cause.hook("on_robot")
            if hook is not None:
                changed = hook(robot, cause.aimed(self.actuators), cause.values)
                if changed is not robot:
                    key.append((cause.name, cause.target, tuple(sorted(cause.values.items()))))
                robot = changed
        return robot, tuple(key)

    # -- the signal path ----------------------------------------------------------------------------------------------

    def sense(
        self,
        run_path: RunPath,
        causes: Sequence[Cause] = (),
        *,
        solved: Solved | None = None,
        slopes: Slopes | None = None,
        measured: Floats | None = None,
    ) -> tuple[Reading, Solved]:
        """Readings of a run with the machine's own causes and `causes` on top, and the structure they stand on.

        solved: structure to reuse when the machine is the same and drives and loads differ little (needs slopes).
        measured (n, m): logged encoders; the difference to the model's encoders then moves the carriages too, so that
        what the control does differently is not blamed on what follows it.
        """
        causes = (*self.causes, *causes)
        # control, drive
        robot, key = self.edited(causes)
        grid, rows = self._motions(run_path, causes)
        if robot is not self.robot:
            springs = _springs(robot)
            grid, rows = replace(grid, stiffness=springs), replace(rows, stiffness=springs)
        error, guided = driven(causes, self.actuators, grid)
        carriage = grid.encoder + error if error.any() else grid.encoder
        seen = run_path.time
        for cause in causes:
            if (hook := cause.hook("on_clock")) is not None:
                seen = hook(seen, cause.values)
        late = seen is not run_path.time
        encoder = rows.encoder
        ahead = None
        if measured is not None:
            ahead = np.where(np.isfinite(measured), measured - encoder, 0.0)
        at_tip = _at(run_path, grid, seen, None) if late else rows
        moved = carriage is not run_path.grid_rho
        gap = carriage - run_path.grid_rho if moved else None  # carriage minus set-point
        gap_row = _gap_at(run_path, run_path.time, gap, ahead)
        gap_tip = _gap_at(run_path, seen, gap, ahead) if late else gap_row
        place = _place(run_path)
        place_tip = run_path.place(seen) if late else place
        # structure
        known = solved if slopes is not None else None
        if known is None:
            shift = _piece_means(run_path, gap) if gap is not None else np.zeros((run_path.pieces, len(self.actuators)))
        else:
            shift = known.shift
        load = self._node_load(run_path, grid, causes, known, key)
        if known is None or known.key != key or load.force is not known.force:
            known = self.structure(run_path, self._machine(robot, key), key, shift, load)
        solved = known
        load = self._load(causes, rows, _kept(run_path, "force", lambda: place.of(run_path.node_force)))
        load_tip = self._load(causes, at_tip, place_tip.of(run_path.node_force)) if late else load
        drive, tip = place.of(solved.drive), place_tip.of(solved.tip)
        if slopes is not None:
            at_rows = _slopes_at(run_path, slopes, place, "rows")
            d_rho, d_wrench = self._differences(solved, place, gap_row, load)
            drive = drive + _apply(at_rows.drive_rho, d_rho) + _apply(at_rows.drive_wrench, d_wrench)
            if late:
                at_rows = _slopes_at(run_path, slopes, place_tip, None)
                d_rho, d_wrench = self._differences(solved, place_tip, gap_tip, load_tip)
            tip = tip + _apply(at_rows.tip_rho, d_rho) + _apply(at_rows.tip_wrench, d_wrench)
        for cause in causes:
            if (hook := cause.hook("on_drive_force")) is not None:
                effort = hook(np.zeros_like(grid.encoder), guided, cause.which(self.actuators), cause.values)
                drive = drive + _interpolate(run_path, run_path.time, effort)
        # tool, workpiece, sensor
        for cause in causes:
            if (hook := cause.hook("on_pose")) is not None:
                tip = hook(tip, load_tip, at_tip, cause.values)
        tip = self.to_program(tip)
        for cause in causes:
            if (hook := cause.hook("on_workpiece")) is not None:
                tip = hook(tip, cause.values)
        reading = Reading(tip, encoder, drive, load.force, rows)
        for cause in causes:
            if (hook := cause.hook("on_reading")) is not None:
                reading = hook(reading, rows, cause.values)
        return reading, solved

    def _node_load(
        self, run_path: RunPath, grid: Motion, causes: Sequence[Cause], known: Solved | None, key: tuple[Any, ...]
    ) -> Load:
        """Load to solve the nodes with: that of the structure known so far where slopes may carry on from it.

        Slopes are those of the unchanged machine; a changed one gives way by its own, so its nodes are solved under the load.
        """
        loading = any(cause.hook("on_load") is not None for cause in causes[len(self.causes) :])
        if known is not None and (not loading or key == self.edited(self.causes)[1]):
            return Load(known.force, known.wrench)
        load = self._load(causes, _at(run_path, grid, run_path.node_time, run_path.node_rho), run_path.node_force)
        if known is None:
            return load
        size = _SAME_LOAD * max(float(np.abs(load.force).max(initial=0.0)), float(np.abs(load.wrench).max(initial=0.0)))
        near = (
            np.abs(load.force - known.force).max(initial=0.0) <= size
            and np.abs(load.wrench - known.wrench).max(initial=0.0) <= size
        )
        return Load(known.force, known.wrench) if near and known.key == key else load

    def structure(self, run_path: RunPath, machine: Machine, key: tuple[Any, ...], shift: Floats, load: Load) -> Solved:
        """Loaded equilibrium at the nodes. Raises PhysicsError CC411 when a node cannot be solved."""
        node_piece = np.arange(len(run_path.node_tip)) // max(len(run_path.node_tip) // max(run_path.pieces, 1), 1)
        rho = run_path.node_rho + shift[node_piece]
        state = solve(machine, FREE, run_path.node_tip, force=load.force, wrench=load.wrench, rho=rho, check=False)
        if (state.status != 0).any():
            bad = int(np.argmax(state.status != 0))
            where = np.round(self.to_program(run_path.node_tip[bad]), 3).tolist()
            raise PhysicsError("CC411", f"run '{run_path.name}', tip {where}: {STATUS[int(state.status[bad])]}")
        return Solved(key, shift, load.force, load.wrench, state.tip, state.drive)

    def slopes(self, run_path: RunPath, causes: Sequence[Cause], solved: Solved) -> Slopes:
        """Derivatives of the structure at the nodes, by differences of its own solution."""
        causes = (*self.causes, *causes)
        machine = self._machine(*self.edited(causes))
        key = solved.key
        m = len(self.actuators)
        tips, drives = [], []
        for j in range(m):
            shift = solved.shift + _RHO_STEP * np.eye(m)[j]
            moved = self.structure(run_path, machine, key, shift, Load(solved.force, solved.wrench))
            tips.append((moved.tip - solved.tip) / _RHO_STEP)
            drives.append((moved.drive - solved.drive) / _RHO_STEP)
        for j in range(6):
            step = _FORCE_STEP if j < 3 else _MOMENT_STEP
            load = Load(solved.force, solved.wrench + step * np.eye(6)[j])
            moved = self.structure(run_path, machine, key, solved.shift, load)
            tips.append((moved.tip - solved.tip) / step)
            drives.append((moved.drive - solved.drive) / step)
        tip, drive = np.stack(tips, axis=2), np.stack(drives, axis=2)
        return Slopes(tip[:, :, :m], tip[:, :, m:], drive[:, :, :m], drive[:, :, m:])

    # -- pieces of the path -------------------------------------------------------------------------------------------

    def _machine(self, robot: Robot, key: tuple[Any, ...]) -> Machine:
        """The packed machine; runs of one experiment ask for the same one after each other."""
        if key not in self.machines:
            if len(self.machines) > 4:
                self.machines.clear()
            self.machines[key] = build_machine(robot, self.nominal)
        return self.machines[key]

    def _motions(self, run_path: RunPath, causes: Sequence[Cause]) -> tuple[Motion, Motion]:
        """Motion on the fine grid and at the rows; the same for all causes that leave the control alone."""
        servo = [cause for cause in causes if cause.hook("on_servo") is not None]

        def make() -> tuple[Motion, Motion]:
            grid = self._grid_motion(run_path, servo)
            return grid, _at(run_path, grid, run_path.time, run_path.row_rho)

        return make() if servo else _kept(run_path, "motions", make)

    def _grid_motion(self, run_path: RunPath, servo: Sequence[Cause]) -> Motion:
        home = np.array([a.home for a in self.robot.actuators])
        t = run_path.grid
        temperature = run_path.temperature
        if temperature is not None and len(t) != len(temperature):
            temperature = np.interp(t, run_path.time, temperature)
        dt = np.diff(t, prepend=t[:1])
        worn = run_path.cut_before_min + np.cumsum(dt * run_path.grid_cut) / 60.0
        zero = np.zeros_like(run_path.grid_rho)
        motion = Motion(
            t,
            run_path.started + t,
            worn,
            temperature,
            run_path.grid_rho,
            zero,
            zero,
            home,
            _springs(self.robot),
            run_path.ordered,
        )
        encoder = run_path.grid_rho
        for cause in servo:
            encoder = cause.hook("on_servo")(encoder, motion, cause.which(self.actuators), cause.values)
        speed = np.gradient(encoder, t, axis=0) if run_path.ordered and len(t) > 1 else zero
        return replace(motion, encoder=encoder, speed=speed, direction=travel_direction(run_path, encoder))

    def _load(self, causes: Sequence[Cause], motion: Motion, force: Floats) -> Load:
        load = Load(force, np.zeros((len(force), 6)))
        for cause in causes:
            if (hook := cause.hook("on_load")) is not None:
                load = hook(load, motion, cause.values)
        return load

    def _differences(self, solved: Solved, place: Places, gap: Floats, load: Load) -> tuple[Floats, Floats]:
        """Carriage (n, m) and wrench at the reference (n, 6) beyond what the nodes were solved with."""
        d_rho = gap - solved.shift[place.piece]
        d_force = load.force - place.of(solved.force)
        d_wrench = load.wrench - place.of(solved.wrench)
        lever = self.nominal.tool  # platform axes; its tilt under load is of second order here
        d_wrench = d_wrench + np.concatenate([d_force, np.cross(lever, d_force)], axis=1)
        return d_rho, d_wrench


def _springs(robot: Robot) -> Floats:
    """Stiffness (m,) of the drives; inf = rigid."""
    return np.array([np.inf if a.stiffness is None else a.stiffness for a in robot.actuators])


def twin_of(job: Job) -> Twin:
    """The forward model of a config, its `effects:` included. Raises ConfigError CC205."""
    machine = job.machine
    return Twin(machine.robot, machine.nominal, job.frame.origin, job.frame.rotation, job.causes)


def _kept(run_path: RunPath, name: object, make: Callable[[], Any]) -> Any:
    if name not in run_path.kept:
        run_path.kept[name] = make()
    return run_path.kept[name]


def _place(run_path: RunPath) -> Places:
    out: Places = _kept(run_path, "place", lambda: run_path.place(run_path.time))
    return out


def _slopes_at(run_path: RunPath, slopes: Slopes, place: Places, name: str | None) -> Slopes:
    def make() -> Slopes:
        return Slopes(*(place.of(getattr(slopes, each)) for each in _SLOPES))

    return make() if name is None else _kept(run_path, (name, id(slopes)), make)


def _at(run_path: RunPath, grid: Motion, at: Floats, rho: Floats | None) -> Motion:
    """The grid's motion at other times (n,); rho: set-points there when they are known exactly."""
    setpoint = _interpolate(run_path, at, run_path.grid_rho) if rho is None else rho
    if grid.encoder is not run_path.grid_rho:
        setpoint = setpoint + _interpolate(run_path, at, grid.encoder - run_path.grid_rho)
    temperature = None if grid.temperature is None else _interpolate(run_path, at, grid.temperature[:, None])[:, 0]
    return replace(
        grid,
        time=at,
        common=run_path.started + at,
        cut_min=_interpolate(run_path, at, grid.cut_min[:, None])[:, 0],
        temperature=temperature,
        encoder=setpoint,
        speed=_interpolate(run_path, at, grid.speed),
        direction=_interpolate(run_path, at, grid.direction),
    )


def _gap_at(run_path: RunPath, at: Floats, gap: Floats | None, ahead: Floats | None) -> Floats:
    """Carriage minus set-point (n, m) at times (n,): the model's own, and what the logged encoders add."""
    if gap is None:
        return np.zeros_like(run_path.row_rho) if ahead is None else ahead
    own = _interpolate(run_path, at, gap)
    return own if ahead is None else own + ahead


def _interpolate(run_path: RunPath, at: Floats, values: Floats) -> Floats:
    """Grid values (g, c) at times (n,); rows of unordered poses are the grid itself."""
    if not run_path.ordered:
        return values
    i = np.clip(np.searchsorted(run_path.grid, at, side="right") - 1, 0, len(run_path.grid) - 2)
    step = run_path.grid[i + 1] - run_path.grid[i]
    u = np.clip((at - run_path.grid[i]) / np.where(step > 0, step, 1.0), 0.0, 1.0)[:, None]
    return (1.0 - u) * values[i] + u * values[i + 1]


def _piece_means(run_path: RunPath, gap: Floats) -> Floats:
    """Mean (pieces, m) of grid values (g, m) over each piece."""
    count = np.bincount(run_path.grid_piece, minlength=run_path.pieces)
    total = np.column_stack([np.bincount(run_path.grid_piece, each, run_path.pieces) for each in gap.T])
    return total / np.maximum(count, 1)[:, None]


def _apply(slope: Floats, change: Floats) -> Floats:
    """Slopes (n, 3, k) times changes (n, k)."""
    out: Floats = np.einsum("nik,nk->ni", slope, change)
    return out
