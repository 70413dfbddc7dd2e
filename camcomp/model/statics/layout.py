"""Names of the columns and rows of the flat arrays that the compiled solver works on, and its work arrays.

The state of a chain is one vector z = (spring coordinates; end wrench (6); free joint coordinates): an actuator with
its spring, and each direction of a 6-dof spring, is a spring coordinate; a passive joint is a free joint. A "slot" is a
one-dof motion along the chain, base to end; a parallelogram's swing has two slots with opposite signs.
Rotations are stored as 9 numbers row by row, poses as rotation and position in 12.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

# kinds of element
SHIFT, FIXED, PRISMATIC, REVOLUTE, SPRING, WEIGHT = 0, 1, 2, 3, 4, 5

# columns of Packed.element (integers)
KIND, AXIS, VAR, SLOT, COUNT, SWING, ACT, COMP, ELEMENT_INTS = 0, 1, 2, 3, 4, 5, 6, 7, 13
# KIND; AXIS 0..2 of a joint; VAR first entry in z; SLOT slots in front of the element; COUNT active directions of a
# spring; SWING entry in z of the angle that its stiffness depends on, -1 none; ACT actuator, -1 none; COMP.. which of 6

# columns of Packed.value (floats)
VECTOR, SIGN, STIFFNESS, REST, FORCE, MATRIX, ELEMENT_FLOATS = 9, 12, 13, 14, 15, 18, 198
# The first 9: rotation of FIXED; VECTOR (3) translation, or centre of a weight; SIGN of the variable in a joint; STIFFNESS
# and REST of a joint; FORCE (3) of a weight; MATRIX (5, 6, 6) of the active directions of a spring: what is constant, and
# what is multiplied with cos^2 q, cos q sin q, cos q, sin q of the swing angle q

# columns of Packed.chain (integers): element range, slot range, number of spring coordinates, length of z, actuators
FIRST, LAST, SLOT_FIRST, SLOTS, SPRINGS, SIZE, ACT_FIRST, ACTS, CHAIN_INTS = 0, 1, 2, 3, 4, 5, 6, 7, 8
# columns of Packed.actuator (integers): chain, entry in z, element
A_CHAIN, A_VAR, A_ELEMENT, ACTUATOR_INTS = 0, 1, 2, 3

# rows of Work.slot, three numbers each, world axes: angular rate, linear rate, position; then for one load: velocity of
# its point of attack, moment about the slot, and what the Hessian pairs with later (AHEAD) and earlier (BEHIND) slots
OMEGA, SLIDE, PLACE, MOVE, MOMENT, AHEAD, BEHIND, SLOT_ROWS = 0, 3, 6, 9, 12, 15, 18, 21

MACHINE_LENGTH = 100.0  # mm, weighs rotations against translations


class Packed(NamedTuple):
    """A machine in flat arrays: e elements, s slots, c chains, m actuators (in chain order)."""

    element: Ints  # (e, ELEMENT_INTS)
    value: Floats  # (e, ELEMENT_FLOATS)
    slot_var: Ints  # (s,) entry in z
    chain: Ints  # (c, CHAIN_INTS)
    actuator: Ints  # (m, ACTUATOR_INTS)
    end_compliance: Floats  # (c,) mm/N (and 1e-4 of it in rad/(N mm)), where springs leave the end a rigid direction
    scale: Floats  # (c, n) MACHINE_LENGTH where the entry of z is an angle, 1 for lengths, 0 for the wrench


class Work(NamedTuple):
    """Scratch of one thread; n = longest z, m actuators, c chains."""

    slot: Floats  # (SLOT_ROWS, slots)
    frame: Floats  # (elements, 9): rotation in front of a spring; [:3] point of attack of a weight
    end: Floats  # (12,) pose of the chain's end
    spring: Floats  # (6,) scratch: coordinates of a spring
    residual: Floats  # (n,)
    dz: Floats  # (c, n) step
    matrix: Floats  # (c, n, n + 2 + m) linearised chain, factored; columns: z, residual, its actuators, scratch
    answer: Floats  # (c, n, 7 + m) wrench and free joints: Newton step, by platform twist (6), by its actuators
    margin: Floats  # (c,) smallest relative pivot: positive = stable with the end held
    wrench: Floats  # (c, 6) end wrench at the last linearisation
    machine: Floats  # (6, 6 + m) d(sum of wrenches - load) by platform twist and by actuators
    solve: Floats  # (n, n + 7) scratch of small linear systems
    step: Floats  # (6 + m,) platform twist and actuator steps
    order: Floats  # (6,) twist of the commanded pose
    jacobian: Floats  # (6, n + 1) rigid chain: Jacobian and gap
    rates: Floats  # (m, 6) actuator rates of the rigid machine by platform twist
    y: Floats  # (c, rigid n) nominal joint coordinates of the present point
    y_command: Floats  # (c, rigid n) those of the commanded pose
    goal: Floats  # (12,) nominal platform of the present point
    load: Floats  # (2, 6) part of the load applied: force in front of (0, 0, 0); wrench


class Workspace(NamedTuple):
    """State that the solver keeps from point to point as the start of the next one."""

    y: Floats  # (c, rigid n) nominal joint coordinates
    z: Floats  # (c, n) chain states
    pose: Floats  # (12,) loaded platform
    goal: Floats  # (12,) nominal platform
    y_command: Floats  # (c, rigid n) commanded joint coordinates
    command: Floats  # (12,) commanded platform
    warm: Ints  # (1,) 1 if the point before was solved


def new_memory(elastic: Packed, rigid: Packed) -> Workspace:
    """Workspace before the first point."""
    z, y = np.zeros, rigid.scale.shape
    return Workspace(
        y=z(y),
        z=z(elastic.scale.shape),
        pose=z(12),
        goal=z(12),
        y_command=z(y),
        command=z(12),
        warm=np.zeros(1, np.int64),
    )


def new_work(elastic: Packed, rigid: Packed) -> Work:
    """Work arrays of one thread."""
    n = max(elastic.scale.shape[1], rigid.scale.shape[1])
    c, m = elastic.chain.shape[0], elastic.actuator.shape[0]
    slots = max(1, elastic.chain[:, SLOTS].max(), rigid.chain[:, SLOTS].max())
    elements = max(int((P.chain[:, LAST] - P.chain[:, FIRST]).max()) for P in (elastic, rigid))
    z = np.zeros
    return Work(
        slot=z((SLOT_ROWS, slots)),
        frame=z((elements, 9)),
        end=z(12),
        spring=z(6),
        residual=z(n),
        dz=z((c, n)),
        matrix=z((c, n, n + 2 + m)),
        answer=z((c, n, 7 + m)),
        margin=z(c),
        wrench=z((c, 6)),
        machine=z((6, 6 + m)),
        solve=z((max(n, 6), n + 15 + m)),
        step=z(6 + m),
        order=z(6),
        jacobian=z((6, n + 1)),
        rates=z((m, 6)),
        y=z(rigid.scale.shape),
        y_command=z(rigid.scale.shape),
        goal=z(12),
        load=z((2, 6)),
    )
