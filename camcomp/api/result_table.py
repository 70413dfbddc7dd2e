"""Tables of results: columns as NumPy arrays, with conversion to CSV, Parquet and pandas."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from camcomp.ground.bounds import number_of
from camcomp.ground.csv_table import TableRules, read_csv
from camcomp.ground.errors import ConfigError, shown

if TYPE_CHECKING:
    import pandas

PARQUET = ".parquet"
DECIMALS, DECIMALS_RAD = 6, 9  # of joint tables and logs
FORMULA_STARTS = ("=", "+", "-", "@", "\t", "\r")  # of cells that spreadsheets compute
COUNTS = ("line", "row")
_RULES = TableRules(table="CC450", column="CC450", cell="CC450")


class ResultTable(Mapping[str, NDArray[Any]]):
    """Columns by name in their order, all (n,): numbers with NaN for missing ones, or text."""

    def __init__(self, columns: Mapping[str, NDArray[Any]]) -> None:
        """Raise ValueError for columns of different lengths."""
        self._columns = {name: np.asarray(values) for name, values in columns.items()}
        lengths = {len(values) for values in self._columns.values()}
        if len(lengths) > 1:
            raise ValueError(f"columns of different lengths: {sorted(lengths)}")
        self.rows = lengths.pop() if lengths else 0

    @classmethod
    def of_csv(cls, data: bytes) -> ResultTable:
        """Read a table that `to_csv` or a command has written; a column with other texts than numbers is text.

        Raises ConfigError CC450.
        """
        table = read_csv(data, "table", _RULES, rowless=True)
        table.refuse_twice()
        return cls({name: _numbers(table.texts(j)) for j, name in enumerate(table.header)})

    def __getitem__(self, name: str) -> NDArray[Any]:
        return self._columns[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._columns)

    def __len__(self) -> int:
        return len(self._columns)

    def __repr__(self) -> str:
        return f"ResultTable of {self.rows} rows: {', '.join(self)}"

    def array(self, *names: str) -> NDArray[np.float64]:
        """Columns side by side (n, k)."""
        return np.column_stack([np.asarray(self[name], float) for name in names])

    def to_csv(self) -> bytes:
        """CSV with a row of names, then numbers with six decimals, angles with nine; missing numbers are empty cells.

        Texts that a spreadsheet would read as formulas start with an apostrophe.
        """
        out = io.StringIO()
        write = csv.writer(out, lineterminator="\n")
        write.writerow(self)
        write.writerows(zip(*(_cells(name, values) for name, values in self.items()), strict=True))
        return out.getvalue().encode("utf-8", "backslashreplace")

    def to_parquet(self) -> bytes:
        """Parquet file in full precision. Raises ConfigError CC216 without pyarrow."""
        from camcomp.compensation.report.tables import library

        arrow, parquet = library()
        file = io.BytesIO()
        parquet.write_table(arrow.table(dict(self.items())), file, compression="zstd")
        return file.getvalue()

    def to_file(self, name: str) -> bytes:
        """Bytes of a file called `name`: Parquet by its suffix, else CSV."""
        return self.to_parquet() if name.endswith(PARQUET) else self.to_csv()

    def to_pandas(self) -> pandas.DataFrame:
        """Data frame of pandas. Raises ConfigError CC216 without pandas."""
        try:
            import pandas
        except ImportError as error:
            hint = "pip install 'camcomp[pandas]'; the columns themselves are NumPy arrays: table['x_mm']"
            raise ConfigError("CC216", "data frames need the package pandas", hint=hint) from error
        return pandas.DataFrame(dict(self.items()))


def _numbers(cells: list[str]) -> NDArray[Any]:
    numbers = [number_of(cell) if cell else np.nan for cell in cells]
    return np.array(cells) if None in numbers else np.array(numbers, float)


def _cells(name: str, values: NDArray[Any]) -> list[str]:
    if values.dtype.kind not in "fiu":
        texts = (shown(str(value)) for value in values)
        return [f"'{text}" if text.startswith(FORMULA_STARTS) and number_of(text) is None else text for text in texts]
    digits = 0 if name in COUNTS else DECIMALS_RAD if name.endswith("_rad") else DECIMALS
    zero = f"-{0.0:.{digits}f}"
    texts = ("" if np.isnan(value) else f"{value:.{digits}f}" for value in values.astype(float))
    return [text.removeprefix("-") if text == zero else text for text in texts]
