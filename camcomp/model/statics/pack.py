"""Packing of a Robot into the flat arrays that the compiled solver reads element by element."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from camcomp.ground.records import dataclass, field
from camcomp.model.statics import layout as lay
from camcomp.model.statics.description import (
    Actuator,
    Chain,
    Link,
    Parallelogram,
    Passive,
    Robot,
    Transform,
    Weight,
)
from camcomp.model.statics.layout import MACHINE_LENGTH, Packed
from camcomp.model.statics.links import hinged_bar_stiffness, swinging_pair
from camcomp.model.statics.rotation import exp_rotation

Array = NDArray[np.float64]
RIGID_STIFFNESS = 1e9  # N/mm; N mm/rad times 1e4: 300 N move a "rigid" drive by 0.3 nm
END_COMPLIANCE = 1e-9  # mm/N, given to the end of a chain whose springs leave it a rigid direction


@dataclass(kw_only=True)
class _Rows:
    """Elements of one chain while they are collected: integers, floats, and per variable (is spring, angle, start)."""

    ints: list[NDArray[np.int64]] = field(default_factory=list)
    floats: list[Array] = field(default_factory=list)
    variables: list[tuple[bool, bool, float]] = field(default_factory=list)
    slots: list[int] = field(default_factory=list)  # variable of each slot
    joints: list[int] = field(default_factory=list)  # variable of each joint, base to end, each once
    place: tuple[Array, Array] = field(default_factory=lambda: (np.zeros(3), np.eye(3)))  # at the start pose
    twists: list[Array] = field(
        default_factory=list
    )  # (6,) of each spring direction about the origin, at the start pose
    _pending: tuple[Array, Array] = field(default_factory=lambda: (np.zeros(3), np.eye(3)))

    def add(self, kind: int, **ints: int) -> tuple[NDArray[np.int64], Array]:
        """Append an element behind the pending displacement, and return its two rows."""
        self.flush()
        row, values = np.full(lay.ELEMENT_INTS, 0, np.int64), np.zeros(lay.ELEMENT_FLOATS)
        row[[lay.KIND, lay.SLOT, lay.SWING, lay.ACT]] = kind, len(self.slots), -1, -1
        self.ints.append(row)
        self.floats.append(values)
        return row, values

    def shift(self, translation: Array, rotation: Array) -> None:
        """Rigid displacement; neighbours are merged."""
        (p, Q), (at, R) = self._pending, self.place
        self._pending = p + Q @ translation, Q @ rotation
        self.place = at + R @ translation, R @ rotation

    def flush(self) -> None:
        """Writes the pending displacement as an element, if it is any."""
        (p, Q), self._pending = self._pending, (np.zeros(3), np.eye(3))
        if np.array_equal(Q, np.eye(3)) and not p.any():
            return
        _, values = self.add(lay.SHIFT if np.array_equal(Q, np.eye(3)) else lay.FIXED)
        values[:9], values[lay.VECTOR : lay.VECTOR + 3] = Q.ravel(), p

    def variable(self, spring: bool, angle: bool, start: float) -> int:
        """Index of a new variable of the chain."""
        self.variables.append((spring, angle, start))
        return len(self.variables) - 1

    def joint(self, revolute: bool, axis: Array, variable: int, sign: float = 1.0) -> tuple[NDArray[np.int64], Array]:
        """Append a joint along any axis; the solver has coordinate axes, others are rotated onto x and back."""
        k = int(np.argmax(np.abs(axis)))
        aligned = np.count_nonzero(axis) == 1
        turn = np.eye(3) if aligned else _x_onto(axis)
        self.shift(np.zeros(3), turn)
        row, values = self.add(lay.REVOLUTE if revolute else lay.PRISMATIC)
        row[[lay.VAR, lay.AXIS]] = variable, k if aligned else 0
        values[lay.SIGN] = sign * (np.sign(axis[k]) if aligned else 1.0)
        self.slots.append(variable)
        if variable not in self.joints:
            self.joints.append(variable)
        spring, _, start = self.variables[variable]
        if spring:
            self._twist(axis @ turn, revolute)
        at, R = self.place
        step = sign * start * (axis @ turn)
        self.place = (at, R @ exp_rotation(step)) if revolute else (at + R @ step, R)
        self.shift(np.zeros(3), turn.T)
        return row, values

    def _twist(self, axis: Array, angle: bool) -> None:
        at, R = self.place
        a = R @ axis
        self.twists.append(np.concatenate((np.cross(at, a), a * MACHINE_LENGTH) if angle else (a, np.zeros(3))))

    def spring(self, K: Array, active: tuple[int, ...]) -> tuple[NDArray[np.int64], Array]:
        """A spring of up to six directions."""
        row, values = self.add(lay.SPRING)
        used = [self.variable(True, k >= 3, 0.0) for k in active]
        row[lay.VAR], row[lay.COUNT] = used[0] if used else 0, len(active)
        row[lay.COMP : lay.COMP + len(active)] = active
        values[lay.MATRIX :] = np.stack([_compact(K, active), *np.zeros((4, 6, 6))]).ravel()
        self.slots += used
        for k in active:
            self._twist(np.eye(3)[k % 3], k >= 3)
        return row, values

    def leaves_rigid_direction(self) -> bool:
        """True if some motion of the end is resisted by no spring of the chain, at the start pose."""
        J = np.array(self.twists).reshape(len(self.twists), 6)
        size = np.linalg.norm(J, axis=1)
        return bool(np.linalg.matrix_rank(J[size > 0] / size[size > 0, None], tol=1e-9) < 6)


def _compact(K: Array, active: tuple[int, ...]) -> Array:
    """Rows and columns `active` of K (6, 6), moved to the front of a (6, 6) matrix of zeros."""
    out = np.zeros((6, 6))
    out[: len(active), : len(active)] = K[np.ix_(active, active)]
    return out


def _x_onto(axis: Array) -> Array:
    """Rotation (3, 3) whose first column is the unit vector `axis`."""
    other = np.eye(3)[int(np.argmin(np.abs(axis)))]
    y = np.cross(other, axis)
    y /= np.linalg.norm(y)
    return np.column_stack((axis, y, np.cross(axis, y)))


def _collect(chain: Chain, rigid: bool, actuator_index: dict[str, int]) -> _Rows:
    rows = _Rows()

    def error(six: Array) -> None:
        if not rigid and np.any(six != 0.0):
            rows.shift(six[:3], exp_rotation(six[3:]))

    rows.shift(np.zeros(3), chain.frame)
    error(chain.base_error)
    for e in chain.elements:
        if isinstance(e, Transform):
            rows.shift(e.translation, e.rotation)
        elif isinstance(e, Actuator):
            start = e.home if e.start is None else e.start
            row, values = rows.joint(e.revolute, e.axis, rows.variable(not rigid, e.revolute, start))
            row[lay.ACT] = actuator_index[e.name]
            if not rigid:
                rigid_drive = RIGID_STIFFNESS * (1e4 if e.revolute else 1.0)
                values[lay.STIFFNESS] = rigid_drive if e.stiffness is None else e.stiffness
        elif isinstance(e, Passive):
            _, values = rows.joint(e.revolute, e.axis, rows.variable(False, e.revolute, e.start))
            if not rigid:
                values[lay.STIFFNESS], values[lay.REST] = e.stiffness, e.rest
        elif isinstance(e, Link):
            if not rigid:
                rows.spring(e.stiffness, e.active)
        elif isinstance(e, Parallelogram):
            _parallelogram(rows, e, rigid)
        elif isinstance(e, Weight) and not rigid:
            _, values = rows.add(lay.WEIGHT)
            values[lay.VECTOR : lay.VECTOR + 3], values[lay.FORCE : lay.FORCE + 3] = e.centre, e.force
    error(chain.end_error)
    rows.shift(np.zeros(3), chain.frame.T)
    rows.flush()
    return rows


def _parallelogram(rows: _Rows, e: Parallelogram, rigid: bool) -> None:
    length = float(np.linalg.norm(e.arm))
    along = e.arm / length
    own = np.column_stack((along, e.hinge, np.cross(along, e.hinge)))  # the arm's frame: x along it, y the hinge
    swing = rows.variable(False, True, e.start)
    rows.joint(True, e.hinge, swing)
    rows.shift(e.arm, own)
    if not rigid:
        bar = hinged_bar_stiffness(e.bar_stiffness, np.array([length, 0.0, 0.0]), np.array([0.0, 1.0, 0.0]))
        K, by_swing = swinging_pair(bar, 0.5 * e.width * (own.T @ e.crossbar))
        active = (0, 1, 3, 4, 5)  # the swing itself is a joint
        row, values = rows.spring(K, active)
        row[lay.SWING] = swing
        values[lay.MATRIX :] = np.stack([_compact(part, active) for part in (K, *by_swing)]).ravel()
    rows.shift(np.zeros(3), own.T)
    rows.joint(True, e.hinge, swing, -1.0)


@dataclass(frozen=True)
class Model:
    """A packed machine, its state z (c, n) at the start pose, and per chain the entries of its joints."""

    packed: Packed
    start: Array
    joints: tuple[NDArray[np.int64], ...]


def pack(robot: Robot, *, rigid: bool) -> Model:
    """Flat arrays of the robot; rigid = perfect chains without springs, errors or weights (the control's model)."""
    names = [a.name for a in robot.actuators]
    index = {name: i for i, name in enumerate(names)}
    collected = [_collect(chain, rigid, index) for chain in robot.chains]
    wrench = 0 if rigid else 6
    longest = max(len(rows.variables) for rows in collected) + wrench
    chain = np.zeros((len(collected), lay.CHAIN_INTS), np.int64)
    actuator = np.zeros((len(names), lay.ACTUATOR_INTS), np.int64)
    start, scale = np.zeros((len(collected), longest)), np.zeros((len(collected), longest))
    slot_var: list[int] = []
    joints = []
    element = 0
    for c, rows in enumerate(collected):
        place = _places([spring for spring, _, _ in rows.variables], wrench)
        for v, (_, angle, value) in enumerate(rows.variables):
            start[c, place[v]] = value
            scale[c, place[v]] = MACHINE_LENGTH if angle else 1.0
        acts = [e.name for e in robot.chains[c].elements if isinstance(e, Actuator)]
        chain[c] = (
            element, element + len(rows.ints), len(slot_var), len(rows.slots), sum(s for s, _, _ in rows.variables),
            len(rows.variables) + wrench, index[acts[0]] if acts else 0, len(acts),
        )  # fmt: skip
        for row in rows.ints:
            if row[lay.KIND] in (lay.PRISMATIC, lay.REVOLUTE, lay.SPRING):
                row[lay.VAR] = place[row[lay.VAR]]
            if row[lay.SWING] >= 0:
                row[lay.SWING] = place[row[lay.SWING]]
            if row[lay.ACT] >= 0:
                actuator[row[lay.ACT]] = c, row[lay.VAR], element
            element += 1
        slot_var += [place[v] for v in rows.slots]
        joints.append(np.array([place[v] for v in rows.joints], np.int64))
    rigid_ends = [0.0 if rigid or not rows.leaves_rigid_direction() else END_COMPLIANCE for rows in collected]
    ints = [row for rows in collected for row in rows.ints]
    floats = [row for rows in collected for row in rows.floats]
    packed = Packed(
        element=np.array(ints, np.int64).reshape(len(ints), lay.ELEMENT_INTS),
        value=np.array(floats).reshape(len(ints), lay.ELEMENT_FLOATS),
        slot_var=np.array(slot_var, np.int64),
        chain=chain,
        actuator=actuator,
        end_compliance=np.array(rigid_ends),
        scale=scale,
    )
    return Model(packed, start, tuple(joints))


def _places(springs: list[bool], wrench: int) -> list[int]:
    """Entry in z of each variable: springs first, then the wrench, then the free joints."""
    count = sum(springs)
    out, spring, free = [], 0, count + wrench
    for is_spring in springs:
        out.append(spring if is_spring else free)
        spring, free = (spring + 1, free) if is_spring else (spring, free + 1)
    return out
