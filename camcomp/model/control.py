"""NC programs from disk, read as the control of a machine file would read them."""

from pathlib import Path

from camcomp.gcode.interpret import read_program
from camcomp.gcode.program import Program
from camcomp.gcode.setup import Setup
from camcomp.ground.files import display_name, read_bytes
from camcomp.model.config.spec import Config


def setup_of(config: Config) -> Setup:
    """The control before the program starts, in the terms of the reader."""
    control = config.control
    places = {name: _triple(value) for name, value in control.reference_positions_mm.items()}
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
        increment_mm=control.input_increment_mm,
        table_axes=frozenset(control.table_axes),
        skip_deleted=control.block_delete,
    )


def open_program(path: str | Path, config: Config | None = None) -> Program:
    """A program read with the control of `config`, or with a control's defaults.

    Raises FileError when there is no such file, ProgramError with every mistake in it.
    """
    return program_of(read_bytes(path), display_name(path), config)


def program_of(data: bytes, name: str, config: Config | None = None) -> Program:
    """A program from its bytes, read with the control of `config`. Raises ProgramError with every mistake in it."""
    setup = setup_of(config) if config else Setup()
    dialect = config.control.dialect if config else None
    return read_program(data, name=name, setup=setup, dialect=dialect)


def _triple(values: list[float]) -> tuple[float, float, float]:
    x, y, z = values
    return float(x), float(y), float(z)
