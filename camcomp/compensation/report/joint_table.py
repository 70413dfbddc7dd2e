"""The joint table written batch by batch, as CSV or, by its suffix, as Parquet."""

from __future__ import annotations

from collections.abc import Sequence
from io import BytesIO
from typing import BinaryIO, Protocol

import numpy as np

from camcomp.compensation.program.compensate import Compensated
from camcomp.compensation.report.parquet import SUFFIX, ParquetTable
from camcomp.compensation.report.tables import decimals_of, joint_columns
from camcomp.compensation.totals import JointRows, Totals
from camcomp.gcode.plain_rows import csv_rows
from camcomp.ground.datatypes import Floats, Ints
from camcomp.model.job import Job


class _Sink(Protocol):
    def rows(self, line: Ints, values: Floats) -> None: ...

    def close(self) -> None: ...


class JointTable:
    """Rows of a joint table."""

    def __init__(self, sink: _Sink) -> None:
        self._sink = sink

    def add(self, rows: JointRows) -> None:
        """Adds rows."""
        actuators = np.stack((rows.nominal, rows.joints, rows.drive), axis=2).reshape(len(rows.line), -1)
        behind = [] if rows.behind is None else [rows.behind]
        values = np.column_stack((rows.s, rows.t, rows.target, rows.written, rows.force, actuators, *behind))
        self._sink.rows(rows.line, values)

    def close(self) -> None:
        """Writes the end."""
        self._sink.close()


class _Csv:
    def __init__(self, file: BinaryIO, names: Sequence[str]) -> None:
        self._file = file
        self._decimals = np.array(decimals_of(names[1:]))
        file.write((",".join(names) + "\n").encode())

    def rows(self, line: Ints, values: Floats) -> None:
        self._file.write(csv_rows(line, values, self._decimals))

    def close(self) -> None:
        pass


def joint_table(file: BinaryIO, name: str, job: Job, oriented: bool = False) -> JointTable:
    """A table of the kind that the file's name asks for; oriented: of a program with orientation. Raises ConfigError CC216 when a package is missing."""
    names = joint_columns(job, oriented)
    return JointTable(ParquetTable(file, names) if name.endswith(SUFFIX) else _Csv(file, names))


def joint_bytes(result: Compensated, job: Job, name: str) -> bytes:
    """The joint table of a program that was corrected as a whole."""
    file = BytesIO()
    table = joint_table(file, name, job, result.orienting is not None)
    table.add(Totals(job, result.program.name).add_exact(result))
    table.close()
    return file.getvalue()
