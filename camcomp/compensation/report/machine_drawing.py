"""The machine at one place of a program, as lines: legs, tool and path, with what the load does to them enlarged."""

from __future__ import annotations

import numpy as np
from scipy.optimize import least_squares

from camcomp.compensation.program.compensate import Compensated
from camcomp.compensation.report.figures import DrawnPath
from camcomp.ground.datatypes import Floats
from camcomp.ground.records import dataclass, field, replace
from camcomp.model.job import Job
from camcomp.model.statics.description import Actuator, Chain, Parallelogram, Passive, Robot, Transform
from camcomp.model.statics.rotation import exp_rotation, rotation_vectors
from camcomp.report.plot import INK, Figure, Json, enlarged, in_space, micrometres, numbers, thin

_LENGTH_MM = 300.0  # by which angles are weighed against lengths
_OPEN_MM = 20.0  # a leg that misses its platform by more was not drawn right and is left out
_LONGEST = 3.0  # times the size of the machine: a travel that is longer would leave nothing else to see


@dataclass(frozen=True, eq=False)
class DrawnLeg:
    """A chain as lines: nodes (k, 3) mm from base to platform, bars of a parallelogram (b, 2, 3), way of a slide (2, 3)."""

    name: str
    nodes: Floats
    bars: Floats
    way: Floats | None


def leg_of(chain: Chain, rho: Floats, rotation: Floats, reference: Floats) -> DrawnLeg | None:
    """A chain whose actuators stand at rho, closed on the platform pose by its passive joints; None where it cannot be.

    rotation (3, 3), reference (3,): of the platform, machine frame. Springs are drawn as they are without load.
    """
    joints = [each for each in chain.elements if isinstance(each, Passive | Parallelogram)]
    goal = chain.frame.T @ rotation @ chain.frame
    at = chain.frame.T @ reference

    def gap(angles: Floats) -> Floats:
        leg, turn = _walk(chain, rho, angles)
        lean: Floats = rotation_vectors((turn @ goal.T)[None])[0]
        return np.concatenate((leg.nodes[-1] - at, _LENGTH_MM * lean))

    angles = np.array([each.start for each in joints])
    if len(angles):
        angles = least_squares(gap, angles).x
        if np.linalg.norm(gap(angles)) > _OPEN_MM:
            return None
    leg, to_base = _walk(chain, rho, angles)[0], chain.frame.T
    way = None if leg.way is None else leg.way @ to_base
    return replace(leg, nodes=leg.nodes @ to_base, bars=leg.bars @ to_base, way=way)


def _walk(chain: Chain, rho: Floats, angles: Floats) -> tuple[DrawnLeg, Floats]:
    """A chain and its end rotation (3, 3) in its local axes; behind a slide on the base it begins at its carriage."""
    point, turn, way, on_base = np.zeros(3), np.eye(3), None, True
    nodes, bars = [point], list[Floats]()
    drives, passive = iter(rho), iter(angles)
    for each in chain.elements:
        start = point
        if isinstance(each, Transform):
            point, turn = point + turn @ each.translation, turn @ each.rotation
        elif isinstance(each, Actuator | Passive):
            value = float(next(drives if isinstance(each, Actuator) else passive))
            if each.revolute:
                turn = turn @ exp_rotation(value * each.axis)
            else:
                along = turn @ each.axis
                point = point + value * along
                if on_base and isinstance(each, Actuator) and np.isfinite(each.limits).all():
                    way, nodes = start + np.outer(each.limits, along), []
        elif isinstance(each, Parallelogram):
            point = point + turn @ exp_rotation(float(next(passive)) * each.hinge) @ each.arm
            half = 0.5 * each.width * turn @ each.crossbar
            bars += [np.array([start + side * half, point + side * half]) for side in (-1.0, 1.0)]
        on_base = on_base and isinstance(each, Transform)
        if not nodes or np.linalg.norm(point - start) > 0.0:
            nodes.append(point)
    return DrawnLeg(chain.name, np.array(nodes), np.array(bars).reshape(-1, 2, 3), way), turn


@dataclass(frozen=True, eq=False)
class _Lines:
    """Lines of the drawing: their traces, their points without load, and the shift of every point by the load."""

    traces: list[Json] = field(default_factory=list)
    base: list[dict[str, list[float | None]]] = field(default_factory=list)
    shifts: list[dict[str, list[float | None]]] = field(default_factory=list)

    def add(self, name: str, points: Floats, shift: Floats, style: Json, *, legend: bool = True) -> None:
        """Add a line through points (k, 3) mm with shifts (k, 3) mm."""
        self.traces.append({
            "type": "scatter3d", "mode": "lines", "name": name, "line": style, "showlegend": legend, "hoverinfo": "name",
        })  # fmt: skip
        self.base.append({a: numbers(points[:, i], 4) for i, a in enumerate("xyz")})
        self.shifts.append({a: numbers(shift[:, i], 6) for i, a in enumerate("xyz")})

    def add_leg(self, name: str, leg: DrawnLeg, bent: DrawnLeg, off: Floats, style: Json) -> None:
        """Add a leg and its bars; bent: the same leg behind the tip's shift off (3,) mm."""
        moved = bent.nodes - leg.nodes
        missed = off - moved[-1]  # deflection of springs, which the joints of the drawing cannot follow
        self.add(name, leg.nodes, moved + np.linspace(0.0, 1.0, len(moved))[:, None] * missed, style)
        for bar, bent_bar in zip(leg.bars, bent.bars, strict=True):
            self.add(f"{name}, bar", bar, bent_bar - bar, style | {"width": 3}, legend=False)


def figure_machine(result: Compensated, job: Job, drawn: DrawnPath) -> Figure | None:
    """The machine at the largest error of the original program, deflection enlarged by a slider; None without legs."""
    row = drawn.worst(drawn.before)
    robot = job.machine.nominal
    turn, origin = job.frame.rotation, job.frame.origin
    held = robot.held_rotation
    tip = origin + turn @ result.rows.target[row]
    off = turn @ (result.uncorrected[row] - result.rows.target[row])
    legs = _legs(robot, result.nominal[row], held, tip - held @ robot.tool)
    bent = _legs(robot, result.nominal[row], held, tip + off - held @ robot.tool)
    if not legs or len(bent) != len(legs) or not np.isfinite(off).all():
        return None
    size = float(np.ptp(np.concatenate([tip[None], *(leg.nodes for leg in legs)]), axis=0).max())
    lines = _Lines()
    for i, (leg, other) in enumerate(zip(legs, bent, strict=True)):
        name = leg.name if len(legs) == 1 or leg.name.startswith("leg") else f"leg {leg.name}"
        lines.add_leg(name, leg, other, off, {"color": f"var(--c{i % 6 + 1})", "width": 7})
        if leg.way is not None and np.linalg.norm(leg.way[1] - leg.way[0]) < _LONGEST * size:
            style: Json = {"color": "var(--c6)", "width": 2}
            lines.add(f"travel of {leg.name}", leg.way, np.zeros((2, 3)), style, legend=False)
    tool = np.array([tip - held @ robot.tool, tip])
    lines.add("tool", tool, np.tile(off, (2, 1)), {"color": INK, "width": 9})
    shown = np.flatnonzero(~drawn.hidden)
    shown = shown[thin(result.rows.target[shown])]
    path = origin + result.rows.target[shown] @ turn.T
    lines.add("programmed path", path, 0.0 * path, {"color": INK, "width": 3})
    deviation = np.nan_to_num(result.uncorrected[shown] - result.rows.target[shown]) @ turn.T
    lines.add("original program under load", path, deviation, {"color": "var(--bad)", "width": 4})
    shift = (result.written.end[shown] - result.rows.target[shown]) @ turn.T
    lines.add("commanded instead", path, shift, {"color": "var(--good)", "width": 4})
    largest = float(np.linalg.norm(off))
    words = f"{micrometres(1e3 * largest)} in line {drawn.line[row]}"
    return Figure(
        name="machine-drawn",
        title="The machine where the original program is off most",
        caption=f"Legs, tool and path where the load takes the tip off by {words}. Legs follow the platform; its tilt is not drawn. The "
        "slider says how much deviations are enlarged. Drag to turn.",
        traces=lines.traces,
        layout=in_space(np.concatenate([path, *(leg.nodes for leg in legs)]), (1.0, -1.65, 0.9)),
        height=560,
        exaggerate=enlarged(lines.base, lines.shifts, [], largest, size),
    )


def _legs(robot: Robot, rho: Floats, rotation: Floats, reference: Floats) -> list[DrawnLeg]:
    out, first = [], 0
    for chain in robot.chains:
        count = sum(isinstance(each, Actuator) for each in chain.elements)
        leg = leg_of(chain, rho[first : first + count], rotation, reference)
        first += count
        if leg is not None:
            out.append(leg)
    return out
