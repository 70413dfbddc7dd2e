"""The joint table and the trajectories of a compensation: as CSV, or by the suffix of the file as Parquet.

Parquet files have a fifth of the size of CSV and full precision, and need pyarrow.
"""

from __future__ import annotations

from collections.abc import Sequence
from io import BytesIO
from typing import Any, BinaryIO

import numpy as np

from camcomp.compensation.program.compensate import Compensated
from camcomp.compensation.program.totals import JointTableRows, Totals
from camcomp.gcode.linear_rows import csv_rows
from camcomp.ground.datatypes import Floats, Ints
from camcomp.ground.errors import ConfigError
from camcomp.model.job import Job
from camcomp.model.statics.target import settle

PARQUET = ".parquet"
AT_ONCE = 1 << 12  # rows of CSV, whose text then fits into the cache
DECIMALS = 6
DECIMALS_RAD = 9  # 2 m of reach make 2 nm of it
ORIENTATION = ["a_deg", "b_deg", "c_deg", "ac_deg", "bc_deg", "cc_deg"]  # programmed, corrected
ENGAGEMENT = ["depth_mm", "engaged_rad"]  # where a stock is known


def actuator_columns(job: Job) -> tuple[list[str], list[str], list[str]]:
    """Column names of nominal coordinates, commanded coordinates and drive forces, in actuator order."""
    nominal, commanded, force = [], [], []
    for name, rotary in zip(job.machine.actuators, job.machine.revolute, strict=True):
        length, load = ("rad", "Nmm") if rotary else ("mm", "N")
        nominal.append(f"act_{name}_nominal_{length}")
        commanded.append(f"act_{name}_{length}")
        force.append(f"act_{name}_{load}")
    return nominal, commanded, force


def joint_columns(job: Job, oriented: bool = False) -> list[str]:
    """Column names of the joint table; oriented: of a program with orientation."""
    head = ["line", "s_mm", "t_s", "x_mm", "y_mm", "z_mm", "xc_mm", "yc_mm", "zc_mm", "fx_N", "fy_N", "fz_N"]
    head += [name for trio in zip(*actuator_columns(job), strict=True) for name in trio]
    if job.config.uncertain:
        head += ["band_um", "gain_um"] + (["share"] if job.config.compensation.policy != "full" else [])
    head += ENGAGEMENT if job.config.workpiece.stock is not None else []
    return head + (ORIENTATION if oriented else [])


class JointTable:
    """A joint table, as CSV or, by the suffix of its name, as Parquet."""

    def __init__(self, file: BinaryIO, name: str, job: Job, oriented: bool = False) -> None:
        """oriented: of a program with orientation. Raises ConfigError CC216 without pyarrow."""
        kind = ParquetFile if name.endswith(PARQUET) else CsvFile
        table: ParquetFile | CsvFile = kind(file, joint_columns(job, oriented))
        self._rows, self.close = table.rows, table.close

    def add(self, rows: JointTableRows) -> None:
        """Adds rows."""
        n, m = rows.joints.shape
        actuators = np.stack((rows.nominal, rows.joints, rows.drive), axis=2).reshape(n, 3 * m)
        behind = [] if rows.behind is None else [rows.behind]
        self._rows(
            rows.line, np.column_stack((rows.s, rows.t, rows.target, rows.written, rows.force, actuators, *behind))
        )


class CsvFile:
    """Writes rows of a source line (n,) and values (n, k); those that do not exist are empty cells."""

    def __init__(self, file: BinaryIO, names: Sequence[str]) -> None:
        self._file = file
        self._decimals = np.array([DECIMALS_RAD if name.endswith("_rad") else DECIMALS for name in names[1:]])
        file.write((",".join(names) + "\n").encode())

    def rows(self, line: Ints, values: Floats) -> None:
        """Adds rows."""
        for begin in range(0, len(line), AT_ONCE):
            some = slice(begin, begin + AT_ONCE)
            self._file.write(csv_rows(line[some], values[some], self._decimals))

    def close(self) -> None:
        """Writes the end of the file."""


class ParquetFile:
    """Writes batches of rows."""

    def __init__(self, file: BinaryIO, names: Sequence[str]) -> None:
        """Raises ConfigError CC216 when pyarrow is not installed."""
        self._arrow, parquet = library()
        fields = [(name, self._arrow.int64() if name == "line" else self._arrow.float64()) for name in names]
        self._schema = self._arrow.schema(fields)
        self._writer = parquet.ParquetWriter(file, self._schema, compression="zstd")

    def rows(self, line: Ints, values: Floats) -> None:
        """Adds rows of a source line (n,) and values (n, k)."""
        columns = [line, *values.T]
        arrays = [self._arrow.array(each, field.type) for each, field in zip(columns, self._schema, strict=True)]
        self._writer.write_table(self._arrow.Table.from_arrays(arrays, schema=self._schema))

    def close(self) -> None:
        """Writes the end of the file."""
        self._writer.close()


def library() -> tuple[Any, Any]:
    """Pyarrow and its Parquet part. Raises ConfigError CC216 when it is not installed."""
    try:
        import pyarrow
        from pyarrow import parquet
    except ImportError as error:
        hint = "pip install 'camcomp[parquet]', or name a .csv file"
        raise ConfigError("CC216", "Parquet files need the package pyarrow", hint=hint) from error
    return pyarrow, parquet


def joint_bytes(result: Compensated, job: Job, name: str) -> bytes:
    """The joint table of a program that was corrected as a whole."""
    file = BytesIO()
    table = JointTable(file, name, job, result.orienting is not None)
    table.add(Totals(job).add(result))
    table.close()
    return file.getvalue()


def trajectories(result: Compensated, job: Job) -> dict[str, Floats]:
    """The five trajectories of the tip of seed Fig. 4 (N, 3) mm, program frame, by name: as programmed, as the original program leads it, as commanded.

    The original program on an imperfect machine without load, on a perfect one under the cutting force, and both.
    """
    target = job.frame.to_machine(result.rows.target)
    force = job.frame.vectors(result.rows.force)
    turning, words = result.orienting, result.programmed_words
    rotation = None if turning is None or words is None else turning.platform(words)
    alone, _ = settle(job.real_machine, target, np.zeros_like(force), rotation=rotation)
    loaded, _ = settle(job.perfect_machine, target, force, rotation=rotation)
    return {
        "target": result.rows.target, "chain_error": job.frame.to_program(alone), "force": job.frame.to_program(loaded),
        "both": result.uncorrected, "adjusted": result.written.end,
    }  # fmt: skip


def paths_csv(result: Compensated, job: Job) -> bytes:
    """The trajectories as CSV."""
    curves = trajectories(result, job)
    head = ["line", "s_mm"] + [f"{name}_{axis}_mm" for name in curves for axis in "xyz"]
    file = BytesIO()
    CsvFile(file, head).rows(result.lines, np.column_stack((result.s, *curves.values())))
    return file.getvalue()
