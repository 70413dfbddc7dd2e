"""Experiment file of imported recordings, and names of its runs."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Mapping, Sequence
from os.path import relpath
from pathlib import Path

from camcomp.diagnosis.recordings.run_log import Recording
from camcomp.ground.errors import ConfigError

_PLAIN = re.compile(r"(\.\./)*[A-Za-z_][\w./-]*", re.ASCII)
_WORDS = {"null", "true", "false", "yes", "no", "on", "off", "y", "n"}


def run_names(files: Sequence[str]) -> list[str]:
    """A name per run: the stem of its file, with a number if an earlier run has it in any case."""
    names: list[str] = []
    for file in files:
        stem = "stdin" if file == "-" else Path(file).stem
        taken = {each.casefold() for each in names}
        candidates = (stem if k == 1 else f"{stem}-{k}" for k in range(1, len(files) + 1))
        names.append(next(each for each in candidates if each.casefold() not in taken))
    return names


def experiment_yaml(
    recordings: Sequence[Recording], configs: Sequence[str], folder: Path, holdout: Sequence[str],
    programs: Mapping[str, str], *, cutting: bool, one_clamping: bool,
) -> bytes:  # fmt: skip
    """Experiment file in `folder`; programs: by run. Raises ConfigError CC424."""
    names = [each.name for each in recordings]
    for each in (*holdout, *programs):
        if each not in names:
            raise ConfigError("CC424", f"there is no run '{each}'", hint=f"runs: {', '.join(names)}")
    if "-" in configs:
        raise ConfigError("CC424", "an experiment cannot name standard input as its config", hint="name a file")
    lines = ["# Written by camcomp import.", "config:"]
    lines += [f"  - {_text(_from(folder, each))}" for each in configs]
    lines.append("runs:")
    for name in names:
        keys = {"name": _text(name), "log": _text(f"{name}.csv"), "cutting": "true" if cutting else "false"}
        if name in programs:
            keys["program"] = _text(_from(folder, programs[name]))
        if not one_clamping:
            keys["clamping"] = _text(name)
        lines.append(f"  - {{{', '.join(f'{key}: {value}' for key, value in keys.items())}}}")
    if holdout:
        lines.append(f"holdout: [{', '.join(map(_text, holdout))}]")
    return ("\n".join(lines) + "\n").encode()


def _from(folder: Path, file: str) -> str:
    """The path of a file from a folder; links are resolved, because `..` of a link is another folder."""
    try:
        return Path(relpath(os.path.realpath(file), os.path.realpath(folder))).as_posix()
    except ValueError:  # on another drive
        return os.path.realpath(file)


def _text(value: str) -> str:
    """A YAML string, quoted if YAML would read another type. Raises ConfigError CC424."""
    if not value.isprintable():
        hint = "rename the file, or the folder"
        raise ConfigError("CC424", f"'{value}' is no name that an experiment file can hold", hint=hint)
    plain = _PLAIN.fullmatch(value) and value.lower() not in _WORDS
    return value if plain else json.dumps(value)
