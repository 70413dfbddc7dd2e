"""Choice of the reader of a file by its suffix and its first bytes."""

from __future__ import annotations

from codecs import BOM_UTF16_BE, BOM_UTF16_LE
from collections.abc import Sequence
from pathlib import Path

from camcomp.diagnosis.recordings.mat_file import read_matlab
from camcomp.diagnosis.recordings.mcap_file import read_mcap
from camcomp.diagnosis.recordings.sampled import SampledColumns
from camcomp.diagnosis.recordings.tables import read_text_table
from camcomp.diagnosis.recordings.tdms_file import read_tdms
from camcomp.diagnosis.recordings.twincat import is_scope_text, read_scope
from camcomp.diagnosis.recordings.xlsx_file import read_xlsx
from camcomp.ground.errors import ConfigError, Location

_ELSEWHERE = {  # formats without a maintained reader, and how to convert them
    ".svdx": "export it as CSV, with time columns, in TwinCAT Scope",
    ".svb": "export it as CSV, with time columns, in TwinCAT Scope",
    ".xls": "save it as .xlsx or CSV",
    ".ods": "save it as .xlsx or CSV",
    ".db3": "turn it into MCAP: ros2 bag convert",
    ".bag": "turn it into MCAP: mcap convert",
}
_MCAP, _ZIP, _TDMS = b"\x89MCAP0\r\n", b"PK\x03\x04", b"TDSm"


def read_sampled(
    data: bytes, file: str, names: Sequence[str] = (), period_s: float | None = None
) -> list[SampledColumns]:
    """Columns of a recording. Raises ConfigError CC216, CC421, CC422, CC452."""
    suffix, at = Path(file).suffix.lower(), Location(file, 1, 1)
    if suffix in _ELSEWHERE:
        raise ConfigError("CC452", f"{suffix} files are not read", at=at, hint=_ELSEWHERE[suffix])
    if suffix == ".mat":
        return read_matlab(data, file)
    if suffix == ".mcap" or data.startswith(_MCAP):
        return read_mcap(data, file)
    if suffix == ".tdms" or data.startswith(_TDMS):
        return read_tdms(data, file)
    if suffix == ".xlsx" or data.startswith(_ZIP):
        return read_xlsx(data, file, names)
    if data.startswith((BOM_UTF16_LE, BOM_UTF16_BE)):
        data = data.decode("utf-16", errors="replace").encode()
    if is_scope_text(data):
        return read_scope(data, file)
    if b"\0" in data[:4096]:
        raise ConfigError("CC452", "neither text nor a format that is known", at=at)
    return read_text_table(data, file, names, period_s)
