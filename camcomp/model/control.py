"""NC programs from disk, read as the controller of a machine file reads them."""

import math
from collections.abc import Iterable
from functools import partial
from pathlib import Path

from camcomp.gcode.detect import dialect_of
from camcomp.gcode.interpret import read_program
from camcomp.gcode.likeness import like_a_program
from camcomp.gcode.path_mode import stated_mode
from camcomp.gcode.program import Program
from camcomp.gcode.setup import ASSUMED, Setup
from camcomp.gcode.stated import INCH_MM
from camcomp.gcode.text import Text
from camcomp.ground.errors import Location, ProgramError
from camcomp.ground.files import display_name, read_bytes
from camcomp.ground.records import replace
from camcomp.model.config.spec import Config
from camcomp.model.config.stated import dialect_without_config
from camcomp.model.robot_frames import robot_frames
from camcomp.model.statics.build import rotation_of
from camcomp.model.trajectory.moves import ControlLimits

ACCURACY_NOT_STATED = "control: absolute_accuracy is not stated; where the control corrects the arm's geometry itself, it is corrected twice"
ORIENTING_ACTUATORS = 6  # of a machine that holds the orientation of its tool


def setup_of(config: Config) -> Setup:
    """State of the controller at the start of the program, for the reader."""
    control = config.control
    places = {name: _triple(value) for name, value in control.reference_positions_mm.items()}
    turned = any(config.workpiece.rotation)
    x, y, z = rotation_of(config.workpiece.rotation)
    return Setup(
        start_mm=_triple(control.start_mm),
        offsets={
            "G54": _triple(config.workpiece.origin_mm),
            **{name: _triple(value) for name, value in control.offsets_mm.items()},
        },
        tools=dict(control.tool_lengths_mm),
        home_mm=places.get("G28", (0.0, 0.0, 0.0)),
        second_home_mm=places.get("G30", (0.0, 0.0, 0.0)),
        tool=control.tool_number,
        unit_mm=INCH_MM if control.program_unit == "inch" else 1.0,
        increment_mm=control.input_increment_mm,
        table_axes=frozenset(control.table_axes),
        orients=len(config.robot.actuators) == ORIENTING_ACTUATORS,
        skip_deleted=control.block_delete,
        path_mode=stated_mode(control.path_mode) if control.path_mode else ASSUMED,
        rotation=(_triple(x), _triple(y), _triple(z)) if turned else None,
        frames=partial(robot_frames, config),
    )


def limits_of(config: Config) -> ControlLimits:
    """Limits of the controller: acceleration, velocity, cycle time and look-ahead."""
    control = config.control
    velocity = math.inf if control.velocity_mm_per_s is None else control.velocity_mm_per_s
    return ControlLimits(control.acceleration_mm_per_s2, velocity, control.block_time_s, control.look_ahead_blocks)


def waiting_s(config: Config, dwelt_s: float, tool_changes: int) -> float:
    """Time (s) of dwells and tool changes, which the moves of a program do not contain."""
    return dwelt_s + tool_changes * config.control.tool_change_s


def open_program(path: str | Path, config: Config | None = None) -> Program:
    """Read a program with the controller of `config`, or with a controller's defaults.

    Raises:
        FileError: the file cannot be read.
        ProgramError: one entry per error of the program.
    """
    return program_of(read_bytes(path), display_name(path), config)


def program_of(data: bytes, name: str, config: Config | None = None) -> Program:
    """Read a program from its bytes with the controller of `config`.

    Raises:
        ProgramError: one entry per error of the program; a single one if the bytes are no program.
    """
    setup = setup_of(config) if config else Setup()
    dialect = config.control.dialect if config else dialect_without_config()
    try:
        return _with_remarks(read_program(data, name=name, setup=setup, dialect=dialect), config)
    except ProgramError as error:
        if error.rule != "CC100" and not like_a_program(data) and not _is_robot_program(data, name, dialect):
            raise ProgramError("CC141", "this is no NC program", at=Location(name, 1, 1)) from error
        raise


def _is_robot_program(data: bytes, name: str, dialect: str | None) -> bool:
    return dialect_of(Text.read(data, name), dialect).robot is not None


def _with_remarks(program: Program, config: Config | None) -> Program:
    """The program with remarks on the control that runs it."""
    if program.language.robot is None or config is None or config.control.absolute_accuracy is not None:
        return program
    return replace(program, warnings=(*program.warnings, ACCURACY_NOT_STATED))


def _triple(values: Iterable[float]) -> tuple[float, float, float]:
    x, y, z = values
    return float(x), float(y), float(z)
