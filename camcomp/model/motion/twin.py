"""The one forward model: set-points in time -> control -> drive -> structure -> tool -> workpiece -> sensor.

simulate prints it, diagnose compares it with logs, compensate inverts it. signal_path.py orders the hooks of effects. The
loaded equilibrium is solved at the nodes of a run path, and extended by its derivatives: by the first ones between them, by
the second ones where carriages are far off.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache, cached_property, partial
from itertools import combinations_with_replacement
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from camcomp.ground.datatypes import Floats, Ints
from camcomp.ground.errors import PhysicsError
from camcomp.ground.records import dataclass, field, replace
from camcomp.model import signal_path
from camcomp.model.effect import Cause, Load, Motion
from camcomp.model.job import Job
from camcomp.model.law.covariates import loads_along
from camcomp.model.motion.control_kinematics import ControlKinematics
from camcomp.model.motion.loaded_structure import Slopes, Softer, Solved
from camcomp.model.motion.longer_links import LongerLinks
from camcomp.model.motion.node_pieces import Places
from camcomp.model.motion.run_path import RunPath, travel_direction
from camcomp.model.statics.description import Robot
from camcomp.model.statics.machine import Machine, build_machine
from camcomp.model.statics.masses import has_moved_mass, mass_loads
from camcomp.model.statics.solve import FREE, STATUS, solve

_RHO_STEP = 1e-3  # mm or 1e-3 mrad of drive, to first order linear within 1e-6
_FAR = 0.3  # mm or mrad off the solution, from which on second derivatives count: 0.1 um at an arm of 400 mm
_FAR_STEP = 1.0  # mm or mrad, for second derivatives
_FORCE_STEP = 1.0  # N
_MOMENT_STEP = 100.0  # N mm
_LATELY = 4  # changed machines kept in the cache
_CREEPING = 1e-4  # of the squared largest speed: below it the lateness is undefined
_LATEST_S = 0.1  # largest lateness of a position loop
_SAME_LOAD = 1e-3  # share of the load: tolerance for reusing a solution


@dataclass(frozen=True, eq=False)
class Reading:
    """Readings of the sensors in n rows: tip (n, 3) mm program frame, encoder (n, m), drive (n, m) N, dyno (n, 3) N."""

    tip: Floats
    encoder: Floats
    drive: Floats
    dyno: Floats
    motion: Motion


@dataclass(frozen=True, eq=False)
class Twin(ControlKinematics):
    """Forward model of a machine with effects."""

    causes: tuple[Cause, ...] = ()
    # caches of this machine with these causes; a changed copy starts empty
    _machines: dict[tuple[Any, ...], Machine] = field(default_factory=dict, init=False, repr=False)
    _edited: dict[tuple[int, ...], tuple[tuple[Cause, ...], Robot, tuple[Any, ...]]] = field(
        default_factory=dict, init=False, repr=False
    )
    _usual: WeakKeyDictionary[RunPath, tuple[Motion, Motion, Motion]] = field(
        default_factory=WeakKeyDictionary, init=False, repr=False
    )

    _curved: WeakKeyDictionary[Solved, dict[tuple[int, ...], Floats]] = field(
        default_factory=WeakKeyDictionary, init=False, repr=False
    )

    @cached_property
    def _longer(self) -> LongerLinks:
        """Tip displacement by links that grow."""

        def tips(robot: Robot, run_path: RunPath) -> Floats:
            machine, near, rho = build_machine(robot, self.nominal), run_path.node_tip, run_path.node_rho
            return solve(machine, FREE, near, aim_rotation=run_path.node_rotation, rho=rho, check=False).tip

        return LongerLinks(self.nominal, tips)

    def _at_reference(self, run_path: RunPath) -> Floats:
        """Wrench (3, 6), at turned nodes (q, 3, 6), at the platform reference per force at the tip."""
        lever = self.nominal.tool  # platform axes; its tilt under load is of second order here
        if run_path.node_rotation is None:
            return np.hstack([np.eye(3), np.cross(lever, np.eye(3))])
        levers = run_path.node_rotation @ lever
        force = np.broadcast_to(np.eye(3), (len(levers), 3, 3))
        return np.concatenate([force, np.cross(levers[:, None], force)], axis=2)

    def edited(self, causes: Sequence[Cause]) -> tuple[Robot, tuple[Any, ...]]:
        """The machine changed by effects, and a key that is equal for equal machines."""
        editing = tuple(signal_path.acting(causes, "structure"))
        asked = tuple(map(id, editing))
        if asked not in self._edited:
            if len(self._edited) > _LATELY:
                self._edited.clear()
            robot, by = signal_path.edited(editing, self.actuators, self.robot)
            key = tuple((cause.name, cause.target, tuple(sorted(cause.values.items()))) for cause in by)
            self._edited[asked] = editing, robot, key  # keeps the causes alive, so that their ids stay unique
        return self._edited[asked][1:]

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
        """Readings of a run with the machine's own causes plus `causes`, and the solved structure.

        solved: structure to reuse for the same machine and nearly equal drives and loads (needs slopes).
        measured (n, m): logged encoders; their difference to the modelled ones moves the carriages too, which keeps errors of
        the controller out of the later stages.
        """
        causes = (*self.causes, *causes)
        # control, drive
        robot, key = self.edited(causes)
        grid, near, rows = self._motions(run_path, causes, robot)
        seen = run_path.time if run_path.led else signal_path.clock(causes, run_path.tip_time)
        late = seen is not run_path.time
        stated = not late or seen is run_path.tip_time
        held = self._held(run_path, grid, causes, solved, robot, key)
        rows = replace(
            rows,
            friction=signal_path.friction_behind_play(causes, self.actuators),
            held=lambda: run_path.row_place.of(held()),
            told=lambda: self._told(run_path, run_path.tip_place, run_path.tip_time),
        )
        alone = slopes is not None and stated and signal_path.momentary(causes)
        path, drives = (run_path.around_rows, near) if alone else (run_path, grid)
        gap, effort = self._driven(path, replace(drives, held=lambda: path.grid_place.of(held())), causes)
        ahead = None if measured is None else np.where(np.isfinite(measured), measured - rows.encoder, 0.0)
        at_tip = rows
        if late:
            at_tip = replace(
                _at(run_path, grid, seen, None), told=lambda: self._told(run_path, run_path.place(seen), seen)
            )
        gap_row = _gap_at(path, run_path.time, gap, ahead)
        gap_tip = _gap_at(path, seen, gap, ahead) if late else gap_row
        place = run_path.row_place
        place_tip = place if not late else run_path.tip_place if stated else run_path.place(seen)
        # structure
        known = solved if slopes is not None else None
        load = self._node_load(run_path, grid, causes, known, key)
        if known is None or known.key != key or load is not known.load:
            shift = _piece_means(run_path, gap, len(self.actuators)) if known is None else known.shift
            known = self.structure(
                run_path=run_path, machine=self._machine(robot, key), key=key, shift=shift, load=load, slopes=slopes
            )
        solved = known
        behind = _lateness(run_path, grid) if run_path.told and signal_path.acting(causes, "control") else None
        load, load_tip = _process_loads(run_path, causes, rows, at_tip=at_tip, place_tip=place_tip, behind=behind)
        drive, tip = solved.drives(place), solved.tips(run_path, place_tip, seen)
        if slopes is not None:
            usual = behind is None and not signal_path.acting(causes, "process")
            drive_softer, tip_softer = (solved.softer.drive, solved.softer.tip) if solved.softer else (None, None)
            drive = slopes.drives(place).behind(drive, place, solved, gap_row, load, usual=usual, softer=drive_softer)
            tip = slopes.tips(place_tip).behind(
                tip, place_tip, solved, gap_tip, load_tip, usual=usual, softer=tip_softer
            )
            tip = tip + self._bent(run_path, place_tip, solved, gap_tip - solved.shift[place_tip.piece], robot)
        if effort is not None:
            drive = drive + path.between(effort, run_path.time)
        tip = self._on_workpiece(run_path, causes, tip, load=load_tip, motion=at_tip, place=place_tip)
        return signal_path.read(causes, Reading(tip, rows.encoder, drive, load.force, rows), rows), solved

    def _driven(self, path: RunPath, motion: Motion, causes: Sequence[Cause]) -> tuple[Floats | None, Floats | None]:
        """Carriages minus set-points (g, m) on the grid of a path, and additional drive forces (g, m); None: zero."""
        error, guided = signal_path.driven(causes, self.actuators, motion)
        carriage = motion.encoder + error if error.any() else motion.encoder
        gap = None if carriage is path.grid_rho else carriage - path.grid_rho
        return gap, signal_path.drive_forces(causes, self.actuators, guided)

    def _on_workpiece(
        self, run_path: RunPath, causes: Sequence[Cause], tip: Floats, load: Load, motion: Motion, place: Places
    ) -> Floats:
        """Tips (n, 3), program frame, behind tool and workpiece; tip (n, 3): of the loaded structure, machine frame."""
        length = signal_path.grown(causes, self.actuators, motion)
        tip = tip if length is None else tip + self._longer.way(run_path, place, length)
        tip = signal_path.led(causes, tip, motion, self.nominal, self.origin)
        tip = self.to_program(signal_path.posed(causes, tip, load, motion))
        return signal_path.placed(causes, signal_path.clamped(causes, tip), load, motion)

    def _node_load(
        self, run_path: RunPath, grid: Motion, causes: Sequence[Cause], known: Solved | None, key: tuple[Any, ...]
    ) -> Load:
        """Load for the solution at the nodes: that of the known structure if first derivatives can extend it.

        Slopes belong to the unchanged machine, so that the nodes of a changed one are solved under their own load.
        """
        loading = bool(signal_path.acting(causes[len(self.causes) :], "process"))
        if known is not None and (not loading or key == self.edited(self.causes)[1]):
            return known.load
        load = signal_path.loaded(
            causes, _at(run_path, grid, run_path.node_time, run_path.node_rho), run_path.node_force
        )
        if known is None:
            return load
        size = _SAME_LOAD * max(float(np.abs(load.force).max(initial=0.0)), float(np.abs(load.wrench).max(initial=0.0)))
        near = (
            np.abs(load.force - known.load.force).max(initial=0.0) <= size
            and np.abs(load.wrench - known.load.wrench).max(initial=0.0) <= size
        )
        return known.load if near and known.key == key else load

    def _told(self, run_path: RunPath, place: Places, at: Floats) -> Floats:
        """Commanded tips (n, 3), program frame, at times (n,)."""
        return self.to_program(run_path.tips(run_path.node_tip, place, at))

    def _held(
        self,
        run_path: RunPath,
        grid: Motion,
        causes: Sequence[Cause],
        known: Solved | None,
        robot: Robot,
        key: tuple[Any, ...],
    ) -> Callable[[], Floats]:
        """Function that returns the drive forces (q, m) at the nodes for carriages at their set-points."""

        @cache
        def at_nodes() -> Floats:
            if known is not None:
                return known.drive
            shift = np.zeros((run_path.pieces, len(self.actuators)))
            load = self._node_load(run_path, grid, causes, None, key)
            return self.structure(run_path, self._machine(robot, key), key, shift, load).drive

        return at_nodes

    def structure(
        self,
        run_path: RunPath,
        machine: Machine,
        key: tuple[Any, ...],
        shift: Floats,
        load: Load,
        slopes: Slopes | None = None,
    ) -> Solved:
        """Loaded equilibrium at the nodes. Raises PhysicsError CC411 if a node cannot be solved.

        slopes: derivatives for values between the nodes. If they belong to another machine, one node of every piece with an
        uneven force is also solved under an additional force in every direction.
        """
        q, uneven = len(run_path.node_tip), run_path.uneven
        if slopes is None or slopes.key == key or not len(uneven):
            tip, drive = self._loaded(
                run_path=run_path, machine=machine, nodes=slice(None), shift=shift, force=load.force, wrench=load.wrench
            )
            return Solved(key=key, shift=shift, load=load, tip=tip, drive=drive)
        nodes = np.concatenate([np.arange(q), np.tile(uneven, 3)])
        wrench = load.wrench[nodes]
        wrench[q:] += _FORCE_STEP * self._unit_wrenches(run_path).transpose(1, 0, 2).reshape(-1, 6)
        tip, drive = self._loaded(
            run_path=run_path, machine=machine, nodes=nodes, shift=shift, force=load.force[nodes], wrench=wrench
        )
        softer = Softer(*(
            self._more(run_path, each, usual)
            for each, usual in ((tip, slopes.tip_wrench), (drive, slopes.drive_wrench))
        ))  # fmt: skip
        return Solved(key=key, shift=shift, load=load, tip=tip[:q], drive=drive[:q], softer=softer)

    def _more(self, run_path: RunPath, values: Floats, usual: Floats) -> Floats:
        """Slopes (pieces, ., 3) by force minus usual ones (q, ., 6) by wrench, from nodes with and without additional force."""
        q, uneven = len(run_path.node_tip), run_path.uneven
        pushed = values[q:].reshape(3, len(uneven), -1).transpose(1, 2, 0)
        own = (pushed - values[uneven][:, :, None]) / _FORCE_STEP
        out = np.zeros((run_path.pieces, values.shape[1], 3))
        out[run_path.node_piece[uneven]] = own - usual[uneven] @ self._unit_wrenches(run_path).transpose(0, 2, 1)
        return out

    def _unit_wrenches(self, run_path: RunPath) -> Floats:
        """Wrenches (k, 3, 6) per force at the tip at the k uneven nodes."""
        found, uneven = self._at_reference(run_path), run_path.uneven
        return found[uneven] if found.ndim == 3 else np.broadcast_to(found, (len(uneven), 3, 6))

    def _loaded(
        self,
        run_path: RunPath,
        machine: Machine,
        nodes: slice | Ints,
        shift: Floats,
        force: Floats,
        wrench: Floats,
    ) -> tuple[Floats, Floats]:
        """Tips (k, 3) and drives (k, m) at some nodes under a load (k). Raises PhysicsError CC411."""
        near, of = run_path.node_tip[nodes], run_path.node_piece[nodes]
        rho = run_path.node_rho[nodes] + shift[of]
        turned = None if run_path.node_rotation is None else run_path.node_rotation[nodes]
        state = solve(machine, FREE, near, aim_rotation=turned, force=force, wrench=wrench, rho=rho, check=False)
        if (state.status != 0).any():
            bad = int(np.argmax(state.status != 0))
            where = np.round(self.to_program(near[bad]), 3).tolist()
            raise PhysicsError("CC411", f"run '{run_path.name}', tip {where}: {STATUS[int(state.status[bad])]}")
        return state.tip, state.drive

    def slopes(self, run_path: RunPath, causes: Sequence[Cause], solved: Solved) -> Slopes:
        """Derivatives of the structure at the nodes, by differences of its own solution."""
        causes = (*self.causes, *causes)
        machine = self._machine(*self.edited(causes))
        key = solved.key
        m = len(self.actuators)
        tips, drives = [], []
        for j in range(m):
            shift = solved.shift + _RHO_STEP * np.eye(m)[j]
            moved = self.structure(run_path, machine, key, shift, solved.load)
            tips.append((moved.tip - solved.tip) / _RHO_STEP)
            drives.append((moved.drive - solved.drive) / _RHO_STEP)
        for j in range(6):
            step = _FORCE_STEP if j < 3 else _MOMENT_STEP
            load = Load(solved.load.force, solved.load.wrench + step * np.eye(6)[j])
            moved = self.structure(run_path, machine, key, solved.shift, load)
            tips.append((moved.tip - solved.tip) / step)
            drives.append((moved.drive - solved.drive) / step)
        tip, drive = np.stack(tips, axis=2), np.stack(drives, axis=2)
        return Slopes(
            tip_rho=tip[:, :, :m], tip_wrench=tip[:, :, m:], drive_rho=drive[:, :, :m], drive_wrench=drive[:, :, m:],
            at_reference=self._at_reference(run_path), key=key,
        )  # fmt: skip

    def _bent(self, run_path: RunPath, place: Places, solved: Solved, off: Floats, robot: Robot) -> Floats | float:
        """Second-order part (n, 3) of the tips of carriages (n, m) that stand far off the solution."""
        unit = np.array([1e-3 if a.revolute else 1.0 for a in robot.actuators])
        far = np.flatnonzero((np.abs(off) > _FAR * unit).any(axis=0)).tolist()
        if not far:
            return 0.0
        known, step = self._curved.setdefault(solved, {}), _FAR_STEP * np.diag(unit)

        def moved(*ways: Floats) -> Floats:
            shift = solved.shift + sum(ways)
            return self.structure(run_path, self._machine(robot, solved.key), solved.key, shift, solved.load).tip

        out = np.zeros((len(off), 3))
        for j, k in combinations_with_replacement(far, 2):
            if (j, k) not in known:
                known[j, k] = moved(step[j], step[k]) - moved(step[j], -step[k]) - moved(-step[j], step[k])
                known[j, k] = (known[j, k] + moved(-step[j], -step[k])) / (4.0 * step[j, j] * step[k, k])
            times = (0.5 if j == k else 1.0) * off[:, j] * off[:, k]
            out += place.of(known[j, k]) * times[:, None]
        return out

    # -- pieces of the path -------------------------------------------------------------------------------------------

    def _machine(self, robot: Robot, key: tuple[Any, ...]) -> Machine:
        """The packed machine, cached because consecutive runs of an experiment use the same one."""
        if key not in self._machines:
            if len(self._machines) > _LATELY:
                self._machines.clear()
            self._machines[key] = build_machine(robot, self.nominal)
        return self._machines[key]

    def _motions(self, run_path: RunPath, causes: Sequence[Cause], robot: Robot) -> tuple[Motion, Motion, Motion]:
        """Motion on the fine grid, on the grid around the rows, and at the rows; cached for causes without servo hooks."""
        servo = signal_path.acting(causes, "control")
        if servo or run_path not in self._usual:
            grid = self._grid_motion(run_path, servo)
            motions = grid, _around_rows(run_path, grid), _at(run_path, grid, run_path.time, run_path.row_rho)
            if not servo:
                self._usual[run_path] = motions
        else:
            motions = self._usual[run_path]
        if robot is self.robot:
            return motions
        grid, near, rows = (replace(each, stiffness=signal_path.springs(robot)) for each in motions)
        return grid, near, rows

    def _grid_motion(self, run_path: RunPath, servo: Sequence[Cause]) -> Motion:
        home = np.array([a.home for a in self.robot.actuators])
        t = run_path.grid
        temperature = run_path.temperature
        if temperature is not None and len(t) != len(temperature):
            temperature = np.interp(t, run_path.time, temperature)
        dt = np.diff(t, prepend=t[:1])
        worn = run_path.cut_before_min + run_path.cut_ahead_min + np.cumsum(dt * run_path.grid_cut) / 60.0
        zero = np.zeros_like(run_path.grid_rho)
        motion = Motion(
            time=t, common=run_path.started + t, cut_min=worn, temperature=temperature, encoder=run_path.grid_rho,
            speed=zero, direction=zero, home=home, stiffness=signal_path.springs(self.robot),
            ordered=run_path.ordered, names=self.actuators, cut_before_min=run_path.cut_before_min,
            seams=None if run_path.driven is None else run_path.driven.seams, measured_force=run_path.measured_force,
            stated_loads=partial(loads_along, self.robot),
        )  # fmt: skip
        encoder = signal_path.controlled(servo, self.actuators, motion)
        speed = np.gradient(encoder, t, axis=0) if run_path.ordered and len(t) > 1 else zero
        masses = cache(partial(mass_loads, self.robot, encoder, t if run_path.ordered else None))
        return replace(
            motion, encoder=encoder, speed=speed, direction=travel_direction(run_path, encoder),
            masses=masses if has_moved_mass(self.robot) else None,
        )  # fmt: skip


def twin_of(job: Job) -> Twin:
    """The forward model of a config, its `effects:` included. Raises ConfigError CC205."""
    machine = job.machine
    return Twin(
        robot=machine.robot, nominal=machine.nominal, origin=job.frame.origin, rotation=job.frame.rotation,
        causes=job.causes,
    )  # fmt: skip


def _at(run_path: RunPath, grid: Motion, at: Floats, rho: Floats | None) -> Motion:
    """The grid's motion at other times (n,); rho: set-points there when they are known exactly."""
    setpoint = run_path.between(run_path.grid_rho, at) if rho is None else rho
    if grid.encoder is not run_path.grid_rho:
        setpoint = setpoint + run_path.between(grid.encoder - run_path.grid_rho, at)
    temperature = None if grid.temperature is None else run_path.between(grid.temperature[:, None], at)[:, 0]
    return replace(
        grid, time=at, common=run_path.started + at, cut_min=run_path.between(grid.cut_min[:, None], at)[:, 0],
        temperature=temperature, encoder=setpoint, speed=run_path.between(grid.speed, at),
        direction=run_path.between(grid.direction, at), held=None, told=None,
        masses=grid.masses_at(lambda values: run_path.between(values, at)), seams=None,
    )  # fmt: skip


def _around_rows(run_path: RunPath, grid: Motion) -> Motion:
    """The grid's motion at the instants around the rows."""
    path = run_path.around_rows
    if path is run_path:
        return grid
    near = grid.at(run_path.near_rows)
    return replace(near, encoder=path.grid_rho) if grid.encoder is run_path.grid_rho else near


def _lateness(run_path: RunPath, grid: Motion) -> Floats:
    """Lateness (n,) s of the encoders of a run behind their set-points at the rows, along the direction of travel."""
    speed = np.gradient(run_path.grid_rho, run_path.grid, axis=0)
    fast = np.maximum((speed**2).sum(axis=1), 1e-12)
    late = ((run_path.grid_rho - grid.encoder) * speed).sum(axis=1) / fast
    late = np.where(fast > _CREEPING * fast.max(), np.clip(late, 0.0, _LATEST_S), 0.0)
    return run_path.between(late[:, None], run_path.time)[:, 0]


def _gap_at(run_path: RunPath, at: Floats, gap: Floats | None, ahead: Floats | None) -> Floats:
    """Carriage minus set-point (n, m) at times (n,): the model's own plus the difference of the logged encoders."""
    if gap is None:
        return np.zeros_like(run_path.row_rho) if ahead is None else ahead
    own = run_path.between(gap, at)
    return own if ahead is None else own + ahead


def _process_loads(
    run_path: RunPath, causes: Sequence[Cause], rows: Motion, at_tip: Motion, place_tip: Places, behind: Floats | None
) -> tuple[Load, Load]:
    """Loads at the rows and at the instants of the tip readings.

    behind (n,) s: lateness of the loops by which the force of the set-points acts late; None: it acts at once.
    """
    force, cut = run_path.row_force, place_tip
    if behind is not None:
        force = run_path.forces(run_path.place(run_path.time - behind))
        cut = run_path.place(at_tip.time - behind)
    load = signal_path.loaded(causes, rows, force)
    return load, load if at_tip is rows else signal_path.loaded(causes, at_tip, run_path.forces(cut))


def _piece_means(run_path: RunPath, gap: Floats | None, actuators: int) -> Floats:
    """Mean (pieces, m) of grid values (g, m) over each piece; zero without values."""
    if gap is None:
        return np.zeros((run_path.pieces, actuators))
    count = np.bincount(run_path.grid_piece, minlength=run_path.pieces)
    total = np.column_stack([np.bincount(run_path.grid_piece, each, run_path.pieces) for each in gap.T])
    return total / np.maximum(count, 1)[:, None]
