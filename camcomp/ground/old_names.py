"""Aliases of modules that users' plug-ins import by names of earlier releases.

The list contains the modules named in the documentation or imported by camcomp's own plug-ins.
"""

import sys
from importlib import import_module
from importlib.machinery import ModuleSpec
from types import ModuleType

_MOVED = {
    "camcomp.cutting": "camcomp.model.cutting",
    "camcomp.datatypes": "camcomp.ground.datatypes",
    "camcomp.diagnostics": "camcomp.ground.errors",
    "camcomp.gap.effect": "camcomp.model.effect",
    "camcomp.gap.memory": "camcomp.model.hysteresis",
    "camcomp.specbase": "camcomp.model.config.base",
    "camcomp.speclink": "camcomp.model.config.links",
    "camcomp.statics": "camcomp.model.statics",
}
_EMPTY = "camcomp.gap"  # a package without other modules


class _OldNames:
    """Finder and loader, last in order: the module under an old name is the identical object of the new name."""

    def find_spec(self, name: str, _path: object = None, _target: object = None) -> ModuleSpec | None:
        if name == _EMPTY or _new_name(name) is not None:
            return ModuleSpec(name, self, is_package=name == _EMPTY)  # type: ignore[arg-type]
        return None

    def create_module(self, _spec: ModuleSpec) -> None:
        return None

    def exec_module(self, module: ModuleType) -> None:
        new = _new_name(module.__name__)
        if new is not None:
            sys.modules[module.__name__] = import_module(new)


def _new_name(old: str) -> str | None:
    for start, now in _MOVED.items():
        if old == start or old.startswith(f"{start}."):
            return now + old.removeprefix(start)
    return None


def keep_old_names() -> None:
    """Install the finder of old module names."""
    if not any(isinstance(each, _OldNames) for each in sys.meta_path):
        sys.meta_path.append(_OldNames())
