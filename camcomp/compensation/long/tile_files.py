"""Files that keep the interpolated cubes of a machine between programs.

A file holds the cubes of one machine, range of forces and origin, as field.py makes them; its name and its content say
which. Cubes of other sources of the solver are not used. A file is a copy of what is computed without it, so that
outputs do not depend on whether it is there.
"""

from __future__ import annotations

import hashlib
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from camcomp.ground.errors import FileError
from camcomp.ground.machine_code import CodeFiles, digest, find_folder
from camcomp.model.statics.machine import Machine

MOST_FILES = 16


class TileFiles:
    """The cubes of one machine on disk, in a folder that only the user can change; a damaged file counts as missing."""

    def __init__(self, machine: Machine) -> None:
        own = Path(__file__).with_name("field.py")
        numbers = hashlib.sha256()
        parts = (*machine.elastic, *machine.rigid, machine.joint_var, machine.start_pose, machine.start_y)
        tools = (machine.robot.tool, machine.nominal.tool, machine.nominal.held_rotation)
        for each in (*parts, *tools, machine.revolute):
            numbers.update(np.ascontiguousarray(each).tobytes())
        self._machine, self._files = numbers.hexdigest(), None
        with suppress(OSError):
            folder, stamp = find_folder(own), digest(own)
            self._files = None if folder is None else CodeFiles(folder, "tiles", stamp)

    def load(self, key: tuple[Any, ...]) -> dict[str, Any] | None:
        """Tiles that were kept; None: there are none."""
        with suppress(Exception):  # a damaged file counts as none
            return self._files.load((self._machine, key)) if self._files is not None else None
        return None

    def save(self, key: tuple[Any, ...], tiles: dict[str, Any] | None) -> None:
        """Keep tiles, and the newest MOST_FILES files. None: forget those of the key."""
        if self._files is None:
            return
        with suppress(OSError, FileError):
            self._files.save((self._machine, key), tiles)
            self._files.leave(MOST_FILES)
