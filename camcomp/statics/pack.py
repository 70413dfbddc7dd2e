"""Packs a Robot into flat arrays that the compiled solver walks through element by element."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from camcomp.statics.description import (
    Actuator,
    Chain,
    Link,
    Parallelogram,
    Passive,
    Robot,
    Transform,
    Weight,
)
from camcomp.statics.links import hinged_bar_stiffness
from camcomp.statics.rotation import exp_rotation

FIXED, PRISMATIC, REVOLUTE, SPRING, WEIGHT = 0, 1, 2, 3, 4
RIGID_STIFFNESS = 1e9  # N/mm or N mm/rad times 1e4: 300 N move a "rigid" drive by 0.3 nm
END_COMPLIANCE = 1e-9  # mm/N, given to the end of a chain that has a rigid direction, so that its wrench is defined
LENGTH = 100.0  # mm, scales rotations against translations


class Packed(NamedTuple):
    """Flat element arrays; e = element, c = chain, variables of a chain are numbered along it."""

    kind: NDArray[np.int64]  # (e,)
    rotation: NDArray[np.float64]  # (e, 3, 3) of a FIXED element
    vector: NDArray[np.float64]  # (e, 3) translation, joint axis, or centre of a weight
    var: NDArray[np.int64]  # (e,) first variable, -1 none
    sign: NDArray[np.float64]  # (e,) coefficient of the variable in a joint
    count: NDArray[np.int64]  # type: ignore[assignment]  # (e,) number of spring directions
    comp: NDArray[np.int64]  # (e, 6) which of the six
    stiffness: NDArray[np.float64]  # (e, 6, 6) spring; of one hinged bar if swing >= 0
    swing: NDArray[np.int64]  # (e,) variable of the swing angle the spring's stiffness depends on, -1 none
    hinge: NDArray[np.float64]  # (e, 3)
    offset: NDArray[np.float64]  # (e, 3) half cross-bar in cross-bar axes, mm
    joint_stiffness: NDArray[np.float64]  # (e,)
    rest: NDArray[np.float64]  # (e,)
    act: NDArray[np.int64]  # (e,) actuator index, -1 none
    force: NDArray[np.float64]  # (e, 3) weight, machine axes
    first: NDArray[np.int64]  # (c + 1,) element ranges of the chains
    nvar: NDArray[np.int64]  # (c,)
    end_compliance: NDArray[np.float64]  # (c,) mm/N
    start: NDArray[np.float64]  # (c, max nvar) variables at the start pose
    act_var: NDArray[np.int64]  # (m,) variable of the actuator
    act_chain: NDArray[np.int64]  # (m,)
    turns: NDArray[np.bool_]  # (c, max nvar) the variable is an angle


def _rows(chain: Chain, rigid: bool, actuator_index: dict[str, int]) -> tuple[list[dict], list[float]]:
    """Element rows of one chain as dicts, and the start values of its variables."""
    rows: list[dict] = []
    start: list[float] = []

    def fixed(translation: NDArray[np.float64], rotation: NDArray[np.float64]) -> None:
        rows.append({"kind": FIXED, "vector": translation, "rotation": rotation})

    def error(six: NDArray[np.float64]) -> None:
        if np.any(six != 0.0):
            fixed(six[:3], exp_rotation(np.asarray(six[3:], float)))

    fixed(np.zeros(3), chain.frame)
    if not rigid:
        error(chain.base_error)
    for e in chain.elements:
        if isinstance(e, Transform):
            fixed(e.translation, e.rotation)
        elif isinstance(e, Actuator):
            k = 0.0 if rigid else (RIGID_STIFFNESS * (1e4 if e.revolute else 1.0) if e.stiffness is None else e.stiffness)
            rows.append(
                {"kind": REVOLUTE if e.revolute else PRISMATIC, "vector": e.axis, "var": len(start), "sign": 1.0,
                 "joint_stiffness": k, "act": actuator_index[e.name]}
            )
            start.append(e.home if e.start is None else e.start)
        elif isinstance(e, Passive):
            rows.append(
                {"kind": REVOLUTE if e.revolute else PRISMATIC, "vector": e.axis, "var": len(start), "sign": 1.0,
                 "joint_stiffness": 0.0 if rigid else e.stiffness, "rest": e.rest}
            )
            start.append(e.start)
        elif isinstance(e, Link):
            if not rigid:
                K = np.zeros((6, 6))
                K[np.ix_(e.active, e.active)] = e.stiffness[np.ix_(e.active, e.active)]
                rows.append({"kind": SPRING, "var": len(start), "stiffness": K, "active": e.active})
                start.extend([0.0] * len(e.active))
        elif isinstance(e, Parallelogram):
            swing = len(start)
            along = e.arm / np.linalg.norm(e.arm)
            own = np.column_stack((along, e.hinge, np.cross(along, e.hinge)))  # the arm's frame: x along it, y the hinge
            rows.append({"kind": REVOLUTE, "vector": e.hinge, "var": swing, "sign": 1.0})
            start.append(e.start)
            fixed(e.arm, own)
            if not rigid:
                y = np.array([0.0, 1.0, 0.0])
                K = hinged_bar_stiffness(e.bar_stiffness, np.array([np.linalg.norm(e.arm), 0.0, 0.0]), y)
                rows.append({"kind": SPRING, "var": len(start), "stiffness": K, "active": (0, 1, 3, 4, 5),
                             "swing": swing, "hinge": y, "offset": 0.5 * e.width * (own.T @ e.crossbar)})
                start.extend([0.0] * 5)
            fixed(np.zeros(3), own.T)
            rows.append({"kind": REVOLUTE, "vector": e.hinge, "var": swing, "sign": -1.0})
        elif isinstance(e, Weight) and not rigid:
            rows.append({"kind": WEIGHT, "vector": e.centre, "force": e.force})
    if not rigid:
        error(chain.end_error)
    fixed(np.zeros(3), chain.frame.T)
    return rows, start


def pack(robot: Robot, *, rigid: bool) -> Packed:
    """Flat arrays of the robot; rigid = perfect chains without springs, errors or weights (the control's model)."""
    index = {a.name: i for i, a in enumerate(robot.actuators)}
    table: list[dict] = []
    starts, first, nvar = [], [0], []
    for chain in robot.chains:
        rows, start = _rows(chain, rigid, index)
        table += rows
        first.append(len(table))
        nvar.append(len(start))
        starts.append(start)
    n = len(table)
    m = len(index)
    out = Packed(
        kind=np.array([r["kind"] for r in table], np.int64),
        rotation=np.array([r.get("rotation", np.eye(3)) for r in table], float).reshape(n, 3, 3),
        vector=np.array([r.get("vector", np.zeros(3)) for r in table], float).reshape(n, 3),
        var=np.array([r.get("var", -1) for r in table], np.int64),
        sign=np.array([r.get("sign", 0.0) for r in table], float),
        count=np.array([len(r.get("active", ())) for r in table], np.int64),
        comp=np.array([(tuple(r.get("active", ())) + (0,) * 6)[:6] for r in table], np.int64).reshape(n, 6),
        stiffness=np.array([r.get("stiffness", np.zeros((6, 6))) for r in table], float).reshape(n, 6, 6),
        swing=np.array([r.get("swing", -1) for r in table], np.int64),
        hinge=np.array([r.get("hinge", np.zeros(3)) for r in table], float).reshape(n, 3),
        offset=np.array([r.get("offset", np.zeros(3)) for r in table], float).reshape(n, 3),
        joint_stiffness=np.array([r.get("joint_stiffness", 0.0) for r in table], float),
        rest=np.array([r.get("rest", 0.0) for r in table], float),
        act=np.array([r.get("act", -1) for r in table], np.int64),
        force=np.array([r.get("force", np.zeros(3)) for r in table], float).reshape(n, 3),
        first=np.array(first, np.int64),
        nvar=np.array(nvar, np.int64),
        end_compliance=np.zeros(len(robot.chains)),
        start=np.array([s + [0.0] * (max(nvar) - len(s)) for s in starts], float).reshape(len(nvar), max(nvar)),
        act_var=np.zeros(m, np.int64),
        act_chain=np.zeros(m, np.int64),
        turns=np.zeros((len(nvar), max(nvar)), np.bool_),
    )
    for c in range(len(robot.chains)):
        for e in range(first[c], first[c + 1]):
            if out.act[e] >= 0:
                out.act_var[out.act[e]] = out.var[e]
                out.act_chain[out.act[e]] = c
            if out.kind[e] == REVOLUTE:
                out.turns[c, out.var[e]] = True
            for i in range(out.count[e]):
                out.turns[c, out.var[e] + i] = out.comp[e, i] >= 3
    return out
