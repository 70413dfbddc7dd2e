"""Reader of TDMS, the files of LabVIEW: channels are called group.channel, waveforms include their times."""

from __future__ import annotations

import io
import logging
from typing import Any

import numpy as np

from camcomp.diagnosis.recordings.sampled import SampledColumns, library, of_values, reading
from camcomp.ground.datatypes import Floats
from camcomp.ground.errors import ConfigError, Location

_Key = tuple[str, int, float | None, float]


def read_tdms(data: bytes, name: str) -> list[SampledColumns]:
    """Channels by group, length and sampling. Raises ConfigError CC216 (package missing), CC452."""
    nptdms = library("nptdms", "npTDMS", "TDMS files")
    together: dict[_Key, list[tuple[str, str, Floats]]] = {}
    dropped = 0
    nptdms.log.log_manager.set_level(logging.CRITICAL)  # the file's status says the same
    with reading(name, "a TDMS file"):
        file = nptdms.TdmsFile.read(io.BytesIO(data))
        for group in file.groups():
            for channel in group.channels():
                values = np.asarray(channel[:])
                if values.ndim != 1 or values.dtype.kind not in "iufb" or not len(values):
                    dropped += 1
                    continue
                unit = str(channel.properties.get("unit_string", ""))
                key = (group.name, len(values), *_sampling(channel.properties))
                together.setdefault(key, []).append((f"{group.name}.{channel.name}", unit, values.astype(float)))
    if not together:
        raise ConfigError("CC452", "the file has no channels with numbers", at=Location(name, 1, 1))
    notes = ["the last segment is not complete"] if file.file_status.channel_statuses is not None else []
    if dropped:
        notes.append(f"{dropped} channels without numbers dropped")
    out = []
    for (_, rows, step, start), channels in together.items():
        time = None if step is None else np.asarray(start + step * np.arange(rows), float)
        labels, units, columns = zip(*channels, strict=True)
        out.append(of_values(name, labels, units, columns, time=time, notes=notes))
        notes = []
    return out


def _sampling(properties: Any) -> tuple[float | None, float]:
    """Step between samples (s, None unless the channel is a waveform), and its start (s)."""
    step = properties.get("wf_increment")
    if not step:
        return None, 0.0
    start = properties.get("wf_start_time")
    since = 0.0 if start is None else np.datetime64(start).astype("datetime64[us]").astype(np.int64) * 1e-6
    return float(step), float(since) + float(properties.get("wf_start_offset", 0.0))
