"""A measured force along the path, from a CSV file (columns: see camcomp/model/cutting/forcetable.py)."""

from functools import lru_cache
from pathlib import Path

from pydantic import Field

from camcomp.ground.datatypes import Floats
from camcomp.ground.errors import FileError
from camcomp.ground.files import read_bytes
from camcomp.model.config.base import Spec
from camcomp.model.cutting.cut import Cut
from camcomp.model.cutting.forcetable import ForceTable, look_up, parse_table
from camcomp.model.cutting.frame import to_components

SOURCES = "The user's own measurement; the table is interpolated linearly along the path."

# The table determines where the tool cuts, plunges included.
PLUNGES = True


class Params(Spec):
    """File of the table and kind of measurement."""

    file: str = Field(description="CSV file; a relative path counts from the folder of the config file")
    on_workpiece: bool = Field(False, description="true when a dynamometer under the work measured; all signs change")


def check(params: Params) -> None:
    """Raise the errors of `force` that concern the table itself."""
    _table(params.file)


def force(cut: Cut, params: Params) -> Floats:
    """(Fr, Ft, Fz) (n, 3) in N. Raises ConfigError CC260 to CC264, FileError CC500."""
    table = _table(params.file)
    value = look_up(table, cut.arc_length, cut.line, cut.ends)
    if table.in_machine:
        value = to_components(value @ cut.to_machine, cut.tangent, cut.tool_axis)
    return -value if params.on_workpiece else value


def _table(name: str) -> ForceTable:
    try:
        stamp = Path(name).stat()
        return _cached(name, stamp.st_mtime_ns, stamp.st_size)
    except (OSError, UnicodeDecodeError) as error:
        raise FileError("CC500", f"the force table {name} cannot be read: {error}") from error


@lru_cache(maxsize=8)
def _cached(name: str, _time: int, _size: int) -> ForceTable:
    return parse_table(read_bytes(name).decode("utf-8", errors="replace"), name)
