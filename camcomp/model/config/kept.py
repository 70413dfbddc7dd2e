"""Checked machine files that are kept for later runs: reading and checking them takes a tenth of the time of a short run.

A configuration is kept as JSON, spec by spec with the values that were checked, for exactly these bytes of its files and this
state of camcomp's sources. Machine files with uncertain numbers, effects, tables, or plug-ins of users are read in every run.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Sequence
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from typing import Any

from camcomp import __version__
from camcomp.ground import shelf
from camcomp.ground.errors import FileError
from camcomp.ground.machine_code import CodeFiles, find_folder
from camcomp.model.config.base import Spec
from camcomp.model.config.linuxcnc_ini import SUFFIX
from camcomp.model.config.spec import Config
from camcomp.model.config.yaml_tree import Node, leaves

Texts = Sequence[tuple[Path | str, bytes]]  # names and contents of machine files
MOST_FILES = 16
_OWN = ("model/config", "forces", "robots")  # folders whose code decides what a machine file means


class KeptConfig:
    """The configuration of machine files on disk, in a folder that only the user can change."""

    def __init__(self, texts: Texts) -> None:
        self._key = [hashlib.sha256(data).hexdigest() for _, data in texts]
        self._files: CodeFiles | None = None
        with suppress(OSError):
            folder = find_folder(Path(__file__))
            if folder is not None and not any(str(name).lower().endswith(SUFFIX) for name, _ in texts):
                self._files = CodeFiles(folder, "machine", _state())

    def load(self) -> Config | None:
        """The kept configuration, if there is one; it lacks the tree."""
        with suppress(Exception):  # a damaged file counts as none
            text = None if self._files is None else self._files.load(self._key)
            config = None if text is None else _read(json.loads(text))
            return config if isinstance(config, Config) else None
        return None

    def save(self, tree: Node, config: Config) -> None:
        """Keep a configuration that its tree alone determines, and the newest MOST_FILES files."""
        if self._files is None or not _stands_alone(tree, config):
            return
        with suppress(OSError, FileError, TypeError):  # TypeError: a plug-in of the user
            self._files.save(self._key, json.dumps(_written(config)))
            self._files.leave(MOST_FILES)


def _stands_alone(tree: Node, config: Config) -> bool:
    """Whether its tree alone determines a configuration, and the specs hold all of it."""
    dialect = config.control.dialect
    names_file = any(name.endswith("file") for name, _ in leaves(tree))
    more = names_file or config.spreads or config.doubts or config.effects
    return not more and (dialect is None or shelf.is_own("dialects", dialect))


def _state() -> str:
    """Version, and sizes and times of the sources."""
    root = Path(__file__).parents[2]
    found = (each for folder in _OWN for each in os.scandir(root / folder) if each.name.endswith(".py"))
    state = sorted((each.path, each.stat().st_size, each.stat().st_mtime_ns) for each in found)
    return hashlib.sha256(repr((__version__, state)).encode()).hexdigest()


def _written(value: Any) -> Any:
    """A value of a spec for JSON. Raises TypeError for one that cannot be restored."""
    if isinstance(value, Spec):
        kind = type(value)
        if (
            not kind.__module__.startswith("camcomp.")
            or getattr(import_module(kind.__module__), kind.__name__, None) is not kind
        ):
            raise TypeError(f"{kind.__name__} is not camcomp's own")
        return {
            "spec": [kind.__module__, kind.__name__],
            "values": _written({**vars(value), **(value.model_extra or {})}),
            "given": sorted(value.model_fields_set),
            "params": _written(getattr(value, "params", None)),
        }
    if isinstance(value, dict):
        return {"items": [[key, _written(each)] for key, each in value.items()]}
    if isinstance(value, list):
        return [_written(each) for each in value]
    if value is None or type(value) in (bool, int, float, str):
        return value
    raise TypeError(f"{type(value).__name__} in a machine file")


def _read(value: Any) -> Any:
    """The value that `_written` made this of."""
    if isinstance(value, list):
        return [_read(each) for each in value]
    if not isinstance(value, dict):
        return value
    if "items" in value:
        return {key: _read(each) for key, each in value["items"]}
    module, name = value["spec"]
    kind: type[Spec] = getattr(import_module(module), name)
    out = kind.model_construct(set(value["given"]), **_read(value["values"]))
    if value["params"] is not None:
        out._params = _read(value["params"])  # type: ignore[attr-defined]
    return out
