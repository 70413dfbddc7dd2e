"""Where measured tables lie, and how they are read: plain numpy, nothing of camcomp."""

from __future__ import annotations

import gzip
import os
from pathlib import Path

import numpy as np
from scipy.io import loadmat

HERE = Path(__file__).parent / "data"
ROOT = Path(__file__).resolve().parents[3]
ELSEWHERE = Path(os.environ.get("CAMCOMP_DATA", "/nowhere"))  # data sets that do not travel

Table = dict[str, np.ndarray]


def read(path: Path) -> Table:
    """Columns of a CSV file (also gzipped) with one header row; empty cells are NaN."""
    with gzip.open(path, "rt") if path.suffix == ".gz" else path.open() as file:
        header = file.readline().strip().split(",")
        rows = [[float(cell or "nan") for cell in line.strip().split(",")] for line in file]
    return dict(zip(header, np.array(rows).T, strict=True))


def write(path: Path, table: Table) -> None:
    """Write columns as CSV."""
    np.savetxt(path, np.stack(list(table.values()), 1), "%.9g", ",", header=",".join(table), comments="")


def kr300(run: str) -> Table:
    """Run A or B of the KUKA KR300, as columns of a log: rad, N mm."""
    table = read(HERE / "kr300" / f"{run}.csv.gz")
    out: Table = {"t_s": table["t_s"]}
    for axis in range(1, 7):
        name = f"A{axis}"
        out[f"cmd_{name}_rad"] = np.radians(table[f"cmd_{name}_deg"])
        out[f"act_{name}_rad"] = np.radians(table[f"act_{name}_deg"])
        if axis <= 3:
            out[f"load_{name}_rad"] = np.radians(table[f"se_{name}_deg"])
        out[f"act_{name}_Nmm"] = 1e3 * table[f"act_{name}_Nm"]
    return out


def emps() -> list[Table]:
    """The two halves in time of the EMPS recording: mm, N."""
    file = loadmat(ELSEWHERE / "emps" / "DATA_EMPS.mat")
    column = {name: np.ravel(file[name]).astype(float) for name in ("t", "qg", "qm", "vir", "gtau")}
    whole = {
        "t_s": column["t"],
        "cmd_x_mm": 1e3 * column["qg"],
        "act_x_mm": 1e3 * column["qm"],
        "act_x_N": column["vir"] * column["gtau"],
    }
    half = len(column["t"]) // 2
    return [{name: values[part] for name, values in whole.items()} for part in (slice(0, half), slice(half, None))]
