"""State of a controller while it executes a program: modes, offsets and position of the tool tip."""

import math
from collections.abc import Mapping
from copy import copy

from camcomp.gcode.codes import OFFSET_NAMES, WORK_OFFSETS
from camcomp.gcode.dialect import Dialect
from camcomp.gcode.setup import Setup
from camcomp.gcode.spelling import SINUMERIK
from camcomp.ground import orientation

_EXTENDED = 300  # G54.1 P1 to P300


class ControlState:
    """Mutable; lengths in mm, positions in the program frame (see Path)."""

    def __init__(self, setup: Setup, dialect: Dialect) -> None:
        self.setup = setup
        self.position = [float(each) for each in setup.start_mm]
        self.commanded = [False, False, False]
        names = list(OFFSET_NAMES)
        if dialect.extended_offsets:
            names += [f"G54.1P{number}" for number in range(1, _EXTENDED + 1)]
        first = len(names)
        names += list(dialect.more_offsets.values())
        self.offset_index = {code: number - 1 for code, number in WORK_OFFSETS.items()}
        self.offset_index.update((code, first + k) for k, code in enumerate(dialect.more_offsets))
        self.work = [[float(each) for each in setup.offsets.get(name, (0.0,) * 3)] for name in names]
        self.zero = list(self.work[0])  # G54 as it stands at program start
        self.active = 0
        self.shift = [0.0, 0.0, 0.0]  # G92, and G52 where they share
        self.saved_shift = [0.0, 0.0, 0.0]
        self.local = [0.0, 0.0, 0.0]  # G52 where it is an offset of its own
        self.tool_offset = [0.0, 0.0, 0.0]
        self.length_on = False  # G43
        self.length_off = False  # D0 of Sinumerik: words lead the spindle nose
        self.tools = dict(setup.tools)
        self.homes = {28: list(setup.home_mm), 30: list(setup.second_home_mm)}
        self.offset = [0.0, 0.0, 0.0]
        self.table = dict.fromkeys(setup.table_axes, 0.0)  # deg
        self.orientation_form = orientation.VECTOR if dialect.spelling is SINUMERIK else orientation.RPY
        self.turned = list(orientation.UPRIGHT[self.orientation_form])  # words of the tool's orientation in force
        self.turns_to = self.turned  # behind the motion of the block
        self.transformed = False  # TRAORI

        self.motion: int | None = dialect.initial_motion  # code in tenths: 0 to 30, a cycle, or None after G80
        self.outside_cycles = self.motion  # the last one that is no cycle
        self.plane = 17
        self.relative = False
        self.centre_absolute = False
        self.feed_mode = 94
        self.unit = setup.unit_mm  # mm per programmed unit
        self.feed_unit = setup.unit_mm  # of feeds
        self.path_mode = setup.path_mode
        self.rounding = 0.0  # ADIS, in units
        self.retract_to_start = dialect.retract_to_start  # G98
        self.feed: float | None = None  # G94: mm/min, G93: 1/min, G95: mm/rev
        self.speed = 0.0
        self.spindle = 5  # M3, M4 or M5
        self.turn = math.nan  # +1, -1, 0 by M3, M4, M5; NaN: none of them yet
        self.no_speed = False  # S0
        self.tool = setup.tool
        self.next_tool = setup.tool
        self.waits = False  # at rest, for something since the last motion
        self.dwelt_s = 0.0  # G4 so far
        self.tool_changes = 0  # M6 so far
        self.update()

    def copy(self) -> "ControlState":
        """The state at this moment; parts that stay the same are shared."""
        out = copy(self)
        for name, value in vars(self).items():
            if isinstance(value, dict):
                setattr(out, name, dict(value))
            elif isinstance(value, list):
                setattr(out, name, [list(each) if isinstance(each, list) else each for each in value])
        return out

    @property
    def sense(self) -> float:
        """Direction of the spindle, as in Path."""
        return 0.0 if self.no_speed else self.turn

    def update(self) -> None:
        """Recompute the sum of offsets, after one of them has changed."""
        work = self.setup.in_program_axes([a - b for a, b in zip(self.work[self.active], self.zero, strict=True)])
        self.offset = [work[axis] + self.shift[axis] + self.local[axis] + self.tool_offset[axis] for axis in range(3)]

    @property
    def machine_position(self) -> list[float]:
        """Machine coordinates (3,) mm of the position."""
        return [a + b for a, b in zip(self.setup.in_machine_axes(self.position), self.zero, strict=True)]

    def at_machine(self, coordinates: Mapping[int, float]) -> list[float]:
        """Position (3,) mm with new coordinates of the given machine axes.

        Program axes that follow from known machine axes count as commanded from then on.
        """
        place = self.machine_position
        known = self.setup.known_in_machine_axes(self.commanded)
        for axis, value in coordinates.items():
            place[axis], known[axis] = value, True
        self.commanded = self.setup.known_in_program_axes(known)
        if self.setup.rotation is None:  # the other axes keep their exact values
            return [coordinates[i] - self.zero[i] if i in coordinates else self.position[i] for i in range(3)]
        return self.setup.in_program_axes([a - b for a, b in zip(place, self.zero, strict=True)])

    def set_work(self, index: int, program: Mapping[int, float]) -> None:
        """Move the origin of a work offset so that the tip has these program coordinates, mm, on the given axes."""
        if self.setup.rotation is None:
            for axis, value in program.items():
                self.work[index][axis] = value + self.zero[axis]
            return
        origin = self.setup.in_program_axes([a - b for a, b in zip(self.work[index], self.zero, strict=True)])
        origin = [program.get(axis, origin[axis]) for axis in range(3)]
        self.work[index] = [a + b for a, b in zip(self.setup.in_machine_axes(origin), self.zero, strict=True)]
