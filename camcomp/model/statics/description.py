"""Description of a machine: chains of elements, before they are packed for the solver.

A machine is a set of serial chains between base and platform (one chain: a serial robot). A chain is a tuple of
elements from base to platform; springs displace by xi = (translation, rotation vector) in the frame in front of them
and store the energy xi^T K xi / 2. Units mm, N, N mm, rad. Descriptions are immutable: an effect on the robot returns
a changed copy.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from camcomp.ground.records import dataclass, field, replace

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Transform:
    """Rigid displacement: first `translation` (3,) mm, then `rotation` (3, 3)."""

    translation: Array = field(default_factory=lambda: np.zeros(3))
    rotation: Array = field(default_factory=lambda: np.eye(3))


@dataclass(frozen=True, kw_only=True)
class Actuator:
    """Actuated joint with its drive spring: coordinate rho (commanded) plus spring deflection.

    stiffness in N/mm (prismatic) or N mm/rad (revolute), None = rigid. home, limits and start in mm or rad; start is
    the coordinate at the machine's start pose, None = home. It fixes the branch of an arm.
    """

    name: str
    revolute: bool
    axis: Array
    stiffness: float | None
    home: float = 0.0
    limits: tuple[float, float] = (-np.inf, np.inf)
    start: float | None = None


@dataclass(frozen=True)
class Passive:
    """Unactuated joint, free (stiffness 0) or with a spring that is relaxed at `rest` (mm or rad).

    `start` is the coordinate guessed at the machine's start pose; it fixes the assembly mode.
    """

    revolute: bool
    axis: Array
    stiffness: float = 0.0
    rest: float = 0.0
    start: float = 0.0


@dataclass(frozen=True)
class Link:
    """Six-dof elastic link. stiffness (6, 6) acts in the `active` directions; the others are rigid."""

    stiffness: Array
    active: tuple[int, ...] = (0, 1, 2, 3, 4, 5)


@dataclass(frozen=True, kw_only=True)
class Parallelogram:
    """Two equal bars between hinges: the arm swings about the hinge axis, the cross-bar keeps its orientation.

    arm (3,) mm; hinge (3,) unit; crossbar (3,) unit; width mm; bar_stiffness (6, 6): tip stiffness of one bar in the
    arm's frame. start: swing angle guessed at the start pose, rad.
    """

    arm: Array
    hinge: Array
    crossbar: Array
    width: float
    bar_stiffness: Array
    start: float = 0.0


@dataclass(frozen=True)
class Weight:
    """Dead load `force` (3,) N in machine axes at `centre` (3,) mm of the current frame (a link's own weight)."""

    force: Array
    centre: Array


Element = Transform | Actuator | Passive | Link | Parallelogram | Weight


@dataclass(frozen=True)
class Chain:
    """One leg. frame (3, 3): columns are the local axes in machine axes. Errors are 6-vectors in local axes."""

    name: str
    elements: tuple[Element, ...]
    frame: Array = field(default_factory=lambda: np.eye(3))
    base_error: Array = field(default_factory=lambda: np.zeros(6))
    end_error: Array = field(default_factory=lambda: np.zeros(6))


@dataclass(frozen=True, kw_only=True)
class Robot:
    """A machine: chains, the tool (3,) mm from the platform reference to the tip, and the start pose (3,) mm, (3, 3).

    held (3, 3): orientation in which the controller keeps the platform along a path; None = that of the start pose.
    """

    name: str
    chains: tuple[Chain, ...]
    tool: Array
    start_reference: Array = field(default_factory=lambda: np.zeros(3))
    start_rotation: Array = field(default_factory=lambda: np.eye(3))
    held: Array | None = None

    @property
    def held_rotation(self) -> Array:
        """Orientation (3, 3) of the platform along a path."""
        return self.start_rotation if self.held is None else self.held

    @property
    def actuators(self) -> tuple[Actuator, ...]:
        """Actuators in chain order; their order is that of every actuator array."""
        return tuple(e for c in self.chains for e in c.elements if isinstance(e, Actuator))

    def edit(self, change: type[Any], by: Callable[[Any], Element], chain: str | None = None) -> Robot:
        """Copy with every element of class `change` (of one chain, or of all) replaced by `by(element)`."""
        chains = tuple(
            replace(c, elements=tuple(by(e) if isinstance(e, change) else e for e in c.elements))
            if chain in (None, c.name)
            else c
            for c in self.chains
        )
        return replace(self, chains=chains)

    def edit_chain(self, chain: str, **fields: Any) -> Robot:
        """Copy with fields of one chain replaced."""
        return replace(self, chains=tuple(replace(c, **fields) if c.name == chain else c for c in self.chains))
