"""Series of columns that count joints instead of naming them: `target_q_0` to `target_q_5`, `position[0]`, `ENC1_POS|1`."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Literal

from camcomp.diagnosis.recordings.units import split_unit

Channel = Literal["setpoint", "encoder", "drive"]
_COUNTED = {"joint", "joints", "axis", "axes", "j", "a", "state", "states"}
_ASKED = {"cmd", "command", "commanded", "set", "setpoint", "target", "des", "desired", "ref", "reference", "d"}
_MET = {"act", "actual", "meas", "measured", "enc", "encoder", "fb", "feedback"}
_PLACE = {"q", "pos", "position", "positions", "angle", "angles"}
_EFFORT = {"tau", "torque", "torques", "effort", "efforts", "force", "forces"}


def numbered_joints(names: Sequence[str], joints: int) -> dict[Channel, list[list[int]]]:
    """Columns of the joints in their order, for every series of a channel that counts all of them from 0 or 1, and no more.

    The last number of a name counts: one before it belongs to the channel, as in encoder 1. names: of the columns, in lower case, words joined by underscores; joints: how many there are.
    """
    series: dict[str, dict[int, int]] = {}
    for column, name in enumerate(names):
        bare = split_unit(name)[0]
        if counted := re.fullmatch(r"(.*?)(\d+)(\D*)", bare):
            series.setdefault(f"{counted[1]} {counted[3]}", {})[int(counted[2])] = column
    found: dict[Channel, list[list[int]]] = {}
    for text, columns in series.items():
        channel = _channel(re.findall(r"[^\W\d_]+", text))
        if channel and sorted(columns) in ([*range(joints)], [*range(1, joints + 1)]):
            found.setdefault(channel, []).append([columns[number] for number in sorted(columns)])
    return found


def _channel(words: Sequence[str]) -> Channel | None:
    """What the words of a series' name say it is, number and unit aside."""
    rest = set(words) - _COUNTED
    asked = bool(rest & _ASKED)
    quantity = rest - _ASKED - _MET
    if words and quantity <= _PLACE:
        return "setpoint" if asked else "encoder"
    return "drive" if words and quantity <= _EFFORT and not asked else None
