"""Parameters of a running program: its own, and those of the controller's state."""

import math

from camcomp.gcode.expressions import Expression, ExpressionError, Memory, evaluate, index_of
from camcomp.gcode.spelling import FANUC, SINUMERIK
from camcomp.gcode.state import ControlState

LOCAL = 30  # #1 to #30 belong to the subprogram in RS274, #1 to #33 in Fanuc
_LAST = 5602  # parameters of RS274
_DEBUG = 5599  # switches messages on and off
_MACHINE_ONLY = "its value is known at the machine only"


class CallFrame:
    """Parameters of one subprogram call."""

    def __init__(self, local: dict[int, float] | None = None) -> None:
        self.numbered: dict[int, float] = local or {}
        self.named: dict[str, float] = {}


class Parameters(Memory):
    """Values by number and by name. Values that only the machine knows raise ExpressionError."""

    def __init__(self, state: ControlState, macro: bool) -> None:
        self.state = state
        self.macro = macro  # Fanuc: an unset parameter is vacant, not zero
        self.spelling = FANUC
        self.common: dict[int, float] = {}
        self.shared: dict[str, float] = {}
        self.frames = [CallFrame()]
        self.row = 0

    def _local(self, number: int) -> bool:
        return 1 <= number <= (33 if self.macro else LOCAL)

    def parameter(self, number: int) -> float:
        """Value of `#number`."""
        store = self.frames[-1].numbered if self._local(number) else self.common
        if number in store:
            return store[number]
        if self.macro and (number == 0 or self._local(number)):
            return math.nan  # vacant
        if self.spelling is SINUMERIK:
            raise ExpressionError(f"R{number} has no value in this program: {_MACHINE_ONLY}", 0)
        value = self._fanuc(number) if self.macro else self._rs274(number)
        if value is None:
            raise ExpressionError(f"parameter #{number}: {_MACHINE_ONLY}", 0)
        return value

    def set(self, number: int, value: float) -> None:
        """Give `#number` a value."""
        if number < 1 or (number >= (1000 if self.macro else 5061) and number != _DEBUG):
            raise ExpressionError(f"parameter #{number} cannot be set: it belongs to the control", 0)
        store = self.frames[-1].numbered if self._local(number) else self.common
        if math.isnan(value):
            store.pop(number, None)
        else:
            store[number] = value

    def _rs274(self, number: int) -> float | None:
        state = self.state
        if 1 <= number < 5061:
            return 0.0
        for first, values in ((5161, state.homes[28]), (5181, state.homes[30]), (5211, state.saved_shift)):
            if first <= number < first + 3:
                return values[number - first]
        if number == 5210:
            return float(any(state.shift))
        if number == 5220:
            return float(state.active + 1)
        if 5221 <= number < 5401 and (number - 5221) % 20 < 3:
            return state.work[(number - 5221) // 20][(number - 5221) % 20]
        if number == 5400:
            return float(state.tool)
        if 5401 <= number <= 5403:
            return state.tool_offset[number - 5401]
        if 5420 <= number <= 5422:
            return self._local_position(number - 5420)
        if 5164 <= number < 5430 and number not in (5410,):
            return 0.0  # axes that the machine does not have
        return None

    def _local_position(self, axis: int) -> float:
        state = self.state
        return (state.position[axis] - state.offset[axis]) / state.unit

    def _fanuc(self, number: int) -> float | None:
        state = self.state
        if 5001 <= number <= 5003 or 5041 <= number <= 5043:
            return self._local_position(number % 10 - 1)
        if 5021 <= number <= 5023:
            axis = number - 5021
            return state.machine_position[axis] / state.unit
        if 5221 <= number <= 5323 and 1 <= number % 20 <= 3:
            return state.work[(number - 5221) // 20][number % 20 - 1] / state.unit
        return None

    def named(self, name: str) -> float | None:
        """Value of `#<name>`."""
        if name in self.shared:
            return self.shared[name]
        if name in self.frames[-1].named:
            return self.frames[-1].named[name]
        return self._predefined(name) if name.startswith("_") else None

    def _predefined(self, name: str) -> float | None:
        state = self.state
        values = {
            "_x": lambda: self._local_position(0),
            "_y": lambda: self._local_position(1),
            "_z": lambda: self._local_position(2),
            "_line": lambda: float(self.row + 1),
            "_plane": lambda: state.plane * 10.0,
            "_metric": lambda: float(state.unit == 1.0),
            "_imperial": lambda: float(state.unit != 1.0),
            "_absolute": lambda: float(not state.relative),
            "_incremental": lambda: float(state.relative),
            "_inverse_time": lambda: float(state.feed_mode == 93),
            "_units_per_minute": lambda: float(state.feed_mode == 94),
            "_units_per_rev": lambda: float(state.feed_mode == 95),
            "_coord_system": lambda: (540.0, 550.0, 560.0, 570.0, 580.0, 590.0, 591.0, 592.0, 593.0)[state.active],
            "_tool_offset": lambda: float(any(state.tool_offset)),
            "_retract_r_plane": lambda: float(not state.retract_to_start),
            "_retract_old_z": lambda: float(state.retract_to_start),
            "_feed": lambda: (state.feed or 0.0) / (1.0 if state.feed_mode == 93 else state.unit),
            "_rpm": lambda: state.speed,
            "_current_tool": lambda: float(state.tool),
            "_selected_tool": lambda: float(state.next_tool),
            "_spindle_on": lambda: float(state.spindle != 5),
            "_spindle_cw": lambda: float(state.spindle == 3),
            "_ccomp": lambda: 400.0,
            "_call_level": lambda: float(len(self.frames) - 1),
            "_value": lambda: 0.0,
            "_value_returned": lambda: 0.0,
        }
        if name in values:
            return values[name]()
        if name in ("_task", "_motion_mode", "_current_pocket", "_selected_pocket", "_vmajor", "_vminor") or name[
            :4
        ] in (
            "_hal",
            "_ini",
        ):
            raise ExpressionError(f"parameter <{name}>: {_MACHINE_ONLY}", 0)
        return None

    def set_named(self, name: str, value: float) -> None:
        """Give `#<name>` a value; names that start with `_` are global."""
        if name.startswith("_"):
            self.shared[name] = value
        else:
            self.frames[-1].named[name] = value

    def exists(self, expression: Expression) -> bool:
        """Whether a parameter was set."""
        if expression[0] == "name":
            try:
                return self.named(expression[1]) is not None
            except ExpressionError:
                return True
        if expression[0] != "parameter":
            raise ExpressionError("EXISTS asks for a parameter", expression[-1])
        number = index_of(expression[1], self, self.spelling, expression[-1])
        if not self.macro:
            return 0 < number <= _LAST
        return number in (self.frames[-1].numbered if self._local(number) else self.common)

    def assign(self, target: Expression, value: float) -> None:
        """Execute `target = value`."""
        if target[0] == "name":
            self.set_named(target[1], value)
        else:
            self.set(index_of(target[1], self, self.spelling, target[-1]), value)

    def value(self, expression: Expression) -> float:
        """Value of an expression; its errors get the column."""
        try:
            return evaluate(expression, self, self.spelling)
        except ExpressionError as error:
            if error.column == 0:
                error.column = expression[-1]
            raise
        except RecursionError:
            raise ExpressionError("the expression is nested too deeply", 0) from None
