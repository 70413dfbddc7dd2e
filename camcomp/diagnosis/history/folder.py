"""Folder with the diagnoses of a machine: a file each, named by its date and a digest of its content."""

from __future__ import annotations

import json
from dataclasses import dataclass
from datetime import date
from hashlib import sha256
from pathlib import Path

from pydantic import ValidationError

from camcomp.diagnosis.result.types import DiagnosisResult
from camcomp.ground.errors import ConfigError, Location
from camcomp.ground.files import read_bytes


@dataclass(frozen=True, eq=False)
class Kept:
    """A diagnosis and the day on which its runs were measured."""

    day: date
    result: DiagnosisResult


def keep(folder: str, result: bytes, *, name: str, day: date) -> tuple[str, bytes]:
    """Path and content of the stored file of a result (its JSON, from the file `name`).

    Raises ConfigError CC454 for other content, CC455 if the folder has the result already.
    """
    found = _result(result, name)
    data = json.dumps({"day": day.isoformat(), "result": found.as_json()}, indent=1, allow_nan=False).encode() + b"\n"
    mark = sha256(found.to_json()).hexdigest()[:8]
    if same := sorted(Path(folder).glob(f"*-{mark}.json")):
        raise ConfigError("CC455", f"{same[0]} has this diagnosis already")
    return str(Path(folder) / f"{day.isoformat()}-{mark}.json"), data


def kept_in(folder: str) -> list[Kept]:
    """All stored diagnoses of a folder, the oldest first. Raises ConfigError CC454, FileError."""
    return sorted((_read(str(path)) for path in Path(folder).glob("*.json")), key=lambda each: each.day)


def _read(path: str) -> Kept:
    whole = _parsed(read_bytes(path), path)
    if not isinstance(whole, dict) or set(whole) != {"day", "result"}:
        raise ConfigError("CC454", f"{path} is no diagnosis that camcomp history keeps", at=Location(path, 1, 1))
    try:
        day = date.fromisoformat(whole["day"])
    except (TypeError, ValueError):
        raise ConfigError("CC454", f"{path}: {whole['day']!r} is no day", at=Location(path, 1, 1)) from None
    return Kept(day, _result(json.dumps(whole["result"]).encode(), path))


def _parsed(data: bytes, name: str) -> object:
    try:
        return json.loads(data)
    except (UnicodeDecodeError, json.JSONDecodeError) as error:
        line, column = (error.lineno, error.colno) if isinstance(error, json.JSONDecodeError) else (1, 1)
        raise ConfigError("CC454", f"{name} is no JSON", at=Location(name, line, column)) from None


def _result(data: bytes, name: str) -> DiagnosisResult:
    try:
        return DiagnosisResult.model_validate(_parsed(data, name))
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(each) for each in first["loc"])
        raise ConfigError(
            "CC454",
            f"{name} is no result of camcomp diagnose: {where or 'it'}: {first['msg']}",
            at=Location(name, 1, 1),
        ) from None
