"""Moves of a robot program become the path of the tool tip.

PTP, MoveJ and J are rapids, LIN, CIRC and their like cuts. Between two poses the orientation makes one turn about a fixed axis.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NoReturn

import numpy as np
from numpy.typing import NDArray

from camcomp.gcode.dialect import Dialect
from camcomp.gcode.path_mode import PathMode
from camcomp.gcode.program import Program, Sites
from camcomp.gcode.robot_circles import arc_through
from camcomp.gcode.robot_frames import SAME_TIP_MM, CoordinateFrame, JointPose, RobotFrames
from camcomp.gcode.robot_language import Collected, MoveSite, RobotLanguage
from camcomp.gcode.setup import Setup
from camcomp.gcode.text import Text
from camcomp.gcode.uncorrected import UncorrectedFeeds
from camcomp.ground.datatypes import ARC, LINE, RAPID, Floats, Ints, Path, frozen
from camcomp.ground.errors import ProgramError
from camcomp.ground.orientation import NEAR_POLE_DEG, TURN, Orientation, pole_free_words

FARTHEST_MM = 1.0e6  # from the base; a kilometre is a typing mistake
_NOTHING = 1e-9  # mm or deg; arithmetic leaves that much
Kinds = NDArray[np.int8]
EXACT = PathMode(exact=True, own_name="exact positioning")


class RobotReader:
    """Collects the moves of one program. Frames, feed and blending are set by the language before each move."""

    def __init__(self, text: Text, setup: Setup, dialect: Dialect, language: RobotLanguage) -> None:
        self.text, self.setup, self.dialect, self.language = text, setup, dialect, language
        self.frames = setup.frames() if setup.frames is not None else RobotFrames()
        self.base: CoordinateFrame = self.frames.program
        self.tool: CoordinateFrame = self.frames.tool_of_machine()
        self._tool_at: int | None = None  # where the tool is stated; None: it is checked
        self.feed: float | None = None  # mm/min
        self.mode = EXACT
        self.waits = False
        self.dwelt_s = 0.0
        self.warnings: list[str] = []
        self.moves = Collected()
        self._joint_poses: list[JointPose] = []
        self._modes: list[PathMode] = []
        self._waits: list[bool] = []
        self._unfollowed = ""  # why the place of the tool is not known
        self._cut_off = True  # the way to the next move is not known

    # --- what languages say ------------------------------------------------------------------------------------

    def refuse(self, rule: str, message: str, at: int, hint: str | None = None) -> NoReturn:
        """Raise an error at a character of the text."""
        row = self.row_of(at)
        raise ProgramError(rule, message, at=self.text.place(row, at - int(self.text.starts[row])), hint=hint or "")

    def row_of(self, at: int) -> int:
        """Line, from 0, of a character."""
        return max(int(np.searchsorted(self.text.starts, at, side="right")) - 1, 0)

    def warn(self, text: str) -> None:
        """Say something once."""
        if text not in self.warnings:
            self.warnings.append(text)

    def set_tool(self, tool: CoordinateFrame, at: int) -> None:
        """Another tool, stated at a character; the first move to a pose with it has to find that of the machine file."""
        self.tool, self._tool_at = tool, at

    def _check_tool(self) -> None:
        at, self._tool_at = self._tool_at, None
        if at is not None and (off := self.frames.off_tip(self.tool)) > SAME_TIP_MM:
            x, y, z = self.frames.tool_of_machine().origin.round(6) + 0.0
            self.refuse(
                "CC145", f"the tip of this tool lies {off:.3f} mm from that of the machine file, {x:g} {y:g} {z:g} of the flange", at,
                hint="correct section tool of the machine file (and robot: flange, control: flange_abc_deg)",
            )  # fmt: skip

    def move(self, kind: int, site: MoveSite, values: Sequence[float], *, middle: Sequence[float] | None = None,
             sweep_deg: float | None = None) -> None:  # fmt: skip
        """A rapid, a line, or an arc through `middle`."""
        at = site.instruction[0]
        self._check_tool()
        if max(map(abs, values[:3])) > FARTHEST_MM:
            self.refuse("CC138", "the point is out of every machine's reach", at)
        if kind != RAPID:
            if not self.feed:
                self.refuse(
                    "CC110",
                    "a cutting motion without a feed",
                    at,
                    hint=f"state its speed, above 0, as {self.dialect.title} does",
                )
            if self._unfollowed:
                self.refuse("CC144", f"the tool starts at joint angles that cannot be followed: {self._unfollowed}", at,
                            hint="go to the start of the cut with a rapid to a Cartesian pose")  # fmt: skip
            if not self.moves.kind and (kind == ARC):
                self.refuse("CC112", "an arc without a known start", at, hint="start with a rapid or a line to a pose")
        self._add(kind=kind, site=site, values=values, middle=middle, sweep=sweep_deg, joints=-1)

    def unknown_move(self, why: str) -> None:
        """A rapid that is passed on, to a place that is not known: cuts from there are refused, with why, if it says something."""
        self._unfollowed, self._cut_off = why, True

    def joint_move(self, site: MoveSite, angles_deg: Sequence[float]) -> None:
        """A rapid to joint angles; it is passed on as it stands."""
        find = self.frames.pose_of_joints
        pose = None if find is None else find(angles_deg)
        if pose is None or pose.why:
            self.unknown_move("" if pose is None else pose.why)
            return
        self._unfollowed = ""
        self._joint_poses.append(pose)
        self._add(
            kind=RAPID, site=site, values=[0.0] * len(self.language.components), middle=None, sweep=None,
            joints=len(self._joint_poses) - 1,
        )  # fmt: skip

    def _add(self, kind: int, site: MoveSite, values: Sequence[float], middle: Sequence[float] | None,
             sweep: float | None, joints: int) -> None:  # fmt: skip
        m = self.moves
        m.kind.append(kind)
        m.values.append(tuple(values))
        m.middle.append(middle)
        m.sweep_deg.append(sweep)
        m.site.append(site)
        m.feed.append(math.nan if kind == RAPID else float(self.feed or math.nan))
        m.joints.append(joints)
        m.alone.append(self._cut_off or joints >= 0)
        self._modes.append(self.mode)
        self._waits.append(self.waits)
        self.waits, self._cut_off, self._unfollowed = False, False, ""

    # --- the path ----------------------------------------------------------------------------------------------

    def program(self) -> Program:
        """The program that was read. Raises ProgramError CC100, CC112 and CC115."""
        m, text = self.moves, self.text
        n = len(m.kind)
        if n == 0:
            raise ProgramError("CC100", "the program moves nothing", at=text.place(0))
        end, words = self._ends()
        alone, joints = np.array(m.alone), np.array(m.joints) >= 0
        start, before = np.roll(end, 1, axis=0), np.roll(words, 1, axis=0)
        start[alone], before[alone] = end[alone], words[alone]
        kind = np.array(m.kind, np.int8)
        centre, axis, angle = self._arcs(kind, start, end)
        self._check_turns(kind=kind, start=start, end=end, before=before, words=words, angle=angle)
        rows = np.array([each.row for each in m.site], np.int64)
        path = Path(
            line=rows + 1, kind=kind, start=start, end=end, centre=centre, axis=axis, angle=angle, feed=np.array(m.feed),
            speed=np.zeros(n), turn=np.full(n, np.nan), tool=np.full(n, self.setup.tool), known=np.ones(n, np.bool_),
            machine=joints, waits=np.array(self._waits), orientation=Orientation(TURN, frozen(before), frozen(words)),
        )  # fmt: skip
        feeds = UncorrectedFeeds(text.name)
        feeds.add(path, from_unknown=alone & (kind != RAPID))
        self.warnings += feeds.warnings()
        return Program(
            data=text.encode(text.string), name=text.name, dialect=self.dialect.name, path=path, warnings=tuple(self.warnings),
            text=text, sites=self._sites(rows, kind), rebases=(), setup=self.setup, language=self.dialect, feed_point=False,
            modes=tuple(self._modes), straight=True, dwelt_s=self.dwelt_s, robot_moves=tuple(m.site), robot_frames=self.frames,
        )  # fmt: skip

    def _ends(self) -> tuple[Floats, Floats]:
        """Tips (n, 3) in the program frame and words (n, 3) of the orientation at the ends of all moves."""
        m, frames = self.moves, self.frames
        values = np.array(m.values, float)
        tips, D = np.empty((len(values), 3)), np.empty((len(values), 3, 3))
        for base, tool, rows in groups(m.site):
            tips[rows], D[rows] = frames.to_program(*self.language.poses(values[rows]), base, tool)
        for k, number in enumerate(m.joints):
            if number >= 0:
                pose = self._joint_poses[number]
                tips[k] = (pose.tip - frames.program.origin) @ frames.program.rotation
                D[k] = frames.turned(pose.rotation[None])[0]
        words = np.unwrap(pole_free_words(D), axis=0, period=360.0)
        words -= 360.0 * np.round(words[0] / 360.0)
        words[np.abs(words) < _NOTHING] = 0.0
        return tips, words

    def _arcs(self, kind: Kinds, start: Floats, end: Floats) -> tuple[Floats, Floats, Floats]:
        """Centres (n, 3), axes (n, 3) and angles (n,) of arcs; ends of those with a sweep of their own are put right."""
        m, n = self.moves, len(kind)
        centre, axis, angle = np.full((n, 3), np.nan), np.zeros((n, 3)), np.zeros(n)
        for k in np.flatnonzero(kind == ARC):
            site, middle = m.site[k], m.middle[k]
            assert middle is not None
            point, turned = self.language.poses(np.array([middle], float))
            through = self.frames.to_program(point, turned, site.base, site.tool)[0][0]
            arc = arc_through(start[k], through, end[k], m.sweep_deg[k])
            if arc is None:
                self.refuse("CC112", "start, auxiliary point and end of the arc lie on one line", site.instruction[0],
                            hint="post a line, or another auxiliary point")  # fmt: skip
            centre[k], axis[k], angle[k], end[k] = arc
            if k + 1 < n and not m.alone[k + 1]:
                start[k + 1] = end[k]
        return centre, axis, angle

    def _check_turns(
        self, kind: Kinds, start: Floats, end: Floats, before: Floats, words: Floats, angle: Floats
    ) -> None:
        """Refuse what cannot be followed in orientation. Raises ProgramError CC115."""
        m = self.moves
        turns = np.abs(words - before).max(axis=1) > 1e-6
        still = (np.linalg.norm(end - start, axis=1) <= _NOTHING) & (kind == LINE)
        for k in np.flatnonzero(turns & still & ~np.array(m.alone)):
            self.refuse("CC115", "a cut that only turns the tool is fed in degrees; turn it with a rapid, or while it moves",
                        m.site[k].instruction[0])  # fmt: skip
        own = np.array([each is not None for each in m.sweep_deg])
        for k in np.flatnonzero(turns & own):
            self.refuse("CC115", "an arc with a sweep of its own turns the tool too", m.site[k].instruction[0])
        for k in np.flatnonzero(np.abs(words[:, 1]) > NEAR_POLE_DEG):
            self.refuse("CC115", "the tool is turned by a right angle about Y of the program frame, where A and C turn about one axis",
                        m.site[k].instruction[0], hint="turn workpiece: rotation_deg")  # fmt: skip

    def _sites(self, rows: Ints, kind: Kinds) -> Sites:
        """Places of the words for messages; robot programs are written from `Program.robot_moves`."""
        n, m = len(rows), self.moves
        begin = np.full((n, 13), -1, np.int64)
        for k, site in enumerate(m.site):
            begin[k, :3] = site.instruction[0]
        no, ones = np.zeros(n, np.bool_), np.ones(n)
        return Sites(
            row=frozen(rows, np.int64), begin=frozen(begin, np.int32), finish=frozen(begin, np.int32), unit=frozen(ones),
            feed_unit=frozen(ones), offset=frozen(np.zeros((n, 3))), relative=frozen(no, np.bool_),
            centre_absolute=frozen(no, np.bool_), code=frozen(np.where(kind == RAPID, 0, 1), np.int8),
            plane=frozen(np.full(n, 17), np.int8), feed_mode=frozen(np.full(n, 94), np.int8), modal_feed=frozen(m.feed),
            moved=frozen(np.ones((n, 3)), np.bool_), code_stated=frozen(no, np.bool_), feed_stated=frozen(no, np.bool_),
            modes_changed=frozen(no, np.bool_), stops=frozen(no, np.bool_), fixed=frozen(no, np.bool_),
            waits_ahead=frozen(self._waits, np.bool_), waits_in_line=frozen(no, np.bool_),
        )  # fmt: skip


def groups(sites: Sequence[MoveSite]) -> list[tuple[CoordinateFrame, CoordinateFrame, Ints]]:
    """Base, tool and rows of the moves that share them."""
    rows: dict[tuple[int, int], list[int]] = {}
    frames: dict[tuple[int, int], tuple[CoordinateFrame, CoordinateFrame]] = {}
    for k, site in enumerate(sites):
        key = (id(site.base), id(site.tool))
        rows.setdefault(key, []).append(k)
        frames[key] = (site.base, site.tool)
    return [(*frames[key], np.array(each, np.int64)) for key, each in rows.items()]


def read_robot_program(text: Text, setup: Setup, dialect: Dialect) -> Program:
    """A program in the language of a robot. Raises ProgramError with every mistake in it."""
    assert dialect.robot is not None
    if setup.frames is not None and not setup.orients:
        raise ProgramError("CC145", "a robot program needs a machine with six actuators", at=text.place(0))
    reader = RobotReader(text, setup, dialect, dialect.robot)
    dialect.robot.read(reader)
    return reader.program()
