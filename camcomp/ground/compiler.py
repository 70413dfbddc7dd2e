"""Numba, imported in one place: what keeps it from starting is said as the mistake in the settings that it is."""

from __future__ import annotations

from typing import Any

from camcomp.ground.errors import ConfigError

try:
    import numba as _imported
except ImportError:
    raise
except Exception as error:
    raise ConfigError(
        "CC205",
        f"numba does not start: {(str(error) or type(error).__name__).splitlines()[0]}",
        hint="look at the environment variables NUMBA_* and at .numba_config.yaml in the current folder",
    ) from error

numba: Any = _imported  # its annotations leave out what it has
