"""State of a control while it executes a program: modes, offsets and where the tool tip stands."""

from camcomp.gcode.codes import OFFSET_NAMES
from camcomp.gcode.program import Setup


class State:
    """Mutable; lengths in mm, positions in the program frame (see Path)."""

    def __init__(self, setup: Setup) -> None:
        self.setup = setup
        self.position = [float(each) for each in setup.start_mm]
        self.commanded = [False, False, False]
        self.work = [[float(each) for each in setup.offsets.get(name, (0.0,) * 3)] for name in OFFSET_NAMES]
        self.zero = list(self.work[0])  # G54 as it stands at program start
        self.active = 0
        self.shift = [0.0, 0.0, 0.0]  # G92, G52
        self.saved_shift = [0.0, 0.0, 0.0]
        self.tool_offset = [0.0, 0.0, 0.0]
        self.tools = dict(setup.tools)
        self.homes = {28: list(setup.home_mm), 30: list(setup.second_home_mm)}
        self.offset = [0.0, 0.0, 0.0]

        self.motion: int | None = None  # 0..3, a cycle (73, 81..89), or None after G80
        self.plane = 17
        self.relative = False
        self.centre_absolute = False
        self.feed_mode = 94
        self.unit = 1.0  # mm per programmed unit
        self.retract_to_start = True  # G98
        self.feed: float | None = None  # G94: mm/min, G93: 1/min, G95: mm/rev
        self.speed = 0.0
        self.tool = setup.tool
        self.next_tool = setup.tool
        self.update()

    def update(self) -> None:
        """Recompute the sum of offsets, after one of them has changed."""
        work = self.work[self.active]
        self.offset = [
            work[axis] + self.shift[axis] + self.tool_offset[axis] - self.zero[axis] for axis in range(3)
        ]
