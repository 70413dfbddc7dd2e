"""MCAP, the container of ROS 2 and others: every topic is a table, its fields are called topic.field.

Members of lists with names get these names: `joint_states.position.elbow_joint`, `tf.tool0.translation.x`. Messages are
ROS 2's, protobuf's or JSON.
"""

from __future__ import annotations

import io
import json
from collections.abc import Callable, Iterator
from numbers import Real
from typing import Any

import numpy as np

from camcomp.diagnosis.recordings.sampled import SampledColumns, library, of_values, reading, some
from camcomp.diagnosis.recordings.units import SI
from camcomp.ground.errors import ConfigError, Location

_WHAT = "an MCAP file"
_LONGEST = 64  # longer lists of numbers are images or point clouds
_IN_SI = ("ros2", "foxglove.")  # encodings and families of schemas whose lengths are m
_NAMES = ("child_frame_id", "name", "joint_name")
_NOT_FIELDS = ("header", "stamp", "timestamp")


def read_mcap(data: bytes, name: str) -> list[SampledColumns]:
    """Topics with numbers. Raises ConfigError CC216 (package missing), CC452 (other file, or no numbers)."""
    reader = library("mcap.reader", "mcap", "MCAP files")
    factories = [
        library("mcap_ros2.decoder", "mcap-ros2-support", "MCAP files").DecoderFactory(),
        library("mcap_protobuf.decoder", "mcap-protobuf-support", "MCAP files").DecoderFactory(),
    ]
    rows: dict[str, list[dict[str, float]]] = {}
    times: dict[str, list[tuple[float, float]]] = {}
    in_si: dict[str, bool] = {}
    unread: dict[str, str] = {}
    with reading(name, _WHAT):
        decoders: dict[int, Callable[[bytes], Any] | None] = {}
        for schema, channel, message in reader.make_reader(io.BytesIO(data)).iter_messages():
            topic = channel.topic.strip("/").replace("/", ".")
            if channel.id not in decoders:
                decoders[channel.id] = _decoder(channel.message_encoding, schema, factories)
            decode = decoders[channel.id]
            if decode is None:
                unread[topic] = channel.message_encoding
                continue
            content = decode(message.data)
            rows.setdefault(topic, []).append(dict(_numbers(content, topic)))
            times.setdefault(topic, []).append((_stamp(content), 1e-9 * message.log_time))
            family = (schema.encoding, schema.name) if schema is not None else ("", "")
            in_si[topic] = family[0].startswith(_IN_SI[0]) or family[1].startswith(_IN_SI[1])
    notes = [f"topics in an encoding that is not read: {some(sorted(unread))}"] if unread else []
    out = []
    for topic, found in rows.items():
        names = list(dict.fromkeys(key for row in found for key in row))
        if names:
            table = np.array([[row.get(key, np.nan) for key in names] for row in found])
            stamps, logged = np.array(times[topic]).T
            time = stamps if np.isfinite(stamps).all() else logged
            units = [SI if in_si[topic] else ""] * len(names)
            out.append(of_values(name, names, units, list(table.T), time=time, notes=notes))
            notes = []
    if not out:
        raise ConfigError("CC452", "the file has no messages with numbers", at=Location(name, 1, 1))
    return out


def _decoder(encoding: str, schema: Any, factories: list[Any]) -> Callable[[bytes], Any] | None:
    if encoding == "json":
        return json.loads
    return next((found for each in factories if (found := each.decoder_for(encoding, schema)) is not None), None)


def _fields(content: Any) -> dict[str, Any] | None:
    """Fields of a message by name; None for other objects."""
    if isinstance(content, dict):
        return content
    if hasattr(content, "DESCRIPTOR"):
        return {each.name: getattr(content, each.name) for each in content.DESCRIPTOR.fields}
    if hasattr(content, "__slots__") and hasattr(content, "_full_text"):
        return {each: getattr(content, each) for each in content.__slots__}
    return None


def _numbers(content: Any, path: str) -> Iterator[tuple[str, float]]:
    """Every number in a message, with its path."""
    if isinstance(content, Real):
        yield path, float(content)
        return
    fields = _fields(content)
    if fields is not None:
        labels: Any = fields.get("name")
        for key, value in fields.items():
            if key in _NOT_FIELDS:
                continue
            if _parallel(labels, value):
                yield from ((f"{path}.{key}.{a}", float(b)) for a, b in zip(labels, value, strict=True))
            else:
                yield from _numbers(value, path if key in ("transforms", "transform") else f"{path}.{key}")
    elif _is_list(content) and len(content) <= _LONGEST:
        for i, member in enumerate(content):
            yield from _numbers(member, f"{path}.{_label(member, i)}")


def _is_list(content: Any) -> bool:
    return not isinstance(content, str | bytes | bytearray) and hasattr(content, "__len__")


def _parallel(labels: Any, values: Any) -> bool:
    """Whether a list has one number for every name of a parallel list, as in JointState."""
    return (
        _is_list(labels) and _is_list(values) and 0 < len(labels) == len(values)
        and all(isinstance(a, str) and isinstance(b, Real) for a, b in zip(labels, values, strict=True))
    )  # fmt: skip


def _label(member: Any, index: int) -> str:
    fields = _fields(member) or {}
    named = (fields[key] for key in _NAMES if isinstance(fields.get(key), str) and fields[key])
    return next(named, str(index)).strip("/").replace("/", ".")


def _stamp(content: Any) -> float:
    """Time stamp of a message in s, of its header or of its first member, or NaN."""
    fields = _fields(content) or {}
    for key in _NOT_FIELDS:
        inner = _fields(fields.get(key)) or {}
        whole, part = (
            inner.get("sec", inner.get("seconds")),
            inner.get("nanosec", inner.get("nanos", inner.get("nsec"))),
        )
        if isinstance(whole, Real) and isinstance(part, Real) and (whole or part):
            return float(whole) + 1e-9 * float(part)
        if inner and np.isfinite(nested := _stamp(fields[key])):
            return nested
    members: Any = fields.get("transforms")
    return _stamp(members[0]) if _is_list(members) and len(members) else float("nan")
