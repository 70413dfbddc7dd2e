"""The joint table written batch by batch, as CSV or, by its suffix, as Parquet."""

from __future__ import annotations

from collections.abc import Sequence
from io import BytesIO
from typing import BinaryIO, Protocol

import numpy as np

from camcomp.compensation.long.totals import Batch
from camcomp.compensation.program.compensate import Compensated
from camcomp.compensation.report.parquet import SUFFIX, ParquetTable
from camcomp.compensation.report.tables import decimals_of, joint_columns, joint_csv, values_behind
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

    def batch(self, batch: Batch) -> None:
        """Adds rows."""
        m = batch.nominal.shape[1]
        actuators = np.stack((batch.nominal, batch.joints, batch.drive), axis=2).reshape(-1, 3 * m)
        behind = [] if batch.behind is None else [batch.behind]
        values = np.column_stack((batch.s, batch.t, batch.target, batch.written, batch.force, actuators, *behind))
        self._sink.rows(batch.line, values)

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
    if not name.endswith(SUFFIX):
        return joint_csv(result, job)
    state = result.state
    file = BytesIO()
    table = joint_table(file, name, job, result.orienting is not None)
    table.batch(
        Batch(
            line=result.lines,
            s=result.s,
            t=result.t,
            target=result.rows.target,
            written=result.written.end,
            force=result.force,
            nominal=result.nominal,
            joints=state.rho,
            drive=state.drive,
            behind=values_behind(result, job),
        )
    )
    table.close()
    return file.getvalue()
