"""Compiled code for wheels and editable installations: the first run is left with making machine code of it."""

import os
import subprocess
import sys
from tempfile import TemporaryDirectory
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

FIRST_RUN = """
import os
from camcomp.ground.machine_code import BROUGHT_ALONG, bring_along
for each in BROUGHT_ALONG.glob("*.nbc"):
    each.unlink()
BROUGHT_ALONG.mkdir(exist_ok=True)
bring_along(BROUGHT_ALONG)
from camcomp.terminal.cli import main
main(["compensate", "samples/groove-circle-50.nc", "--config", "config/orthoglide-1deg.yaml", "-q", "-o", os.devnull])
"""


class CompiledCode(BuildHookInterface):  # type: ignore[type-arg]
    """Runs the first example of the README and keeps what it compiles. Without numba nothing is brought along."""

    def dependencies(self) -> list[str]:
        """What the example needs."""
        return list(self.metadata.core.dependencies)

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Before a wheel is put together."""
        with TemporaryDirectory() as folder:  # what the user's own cache has is not compiled
            alone = {**os.environ, "NUMBA_CACHE_DIR": folder, "PYTHONPATH": self.root}
            made = subprocess.run(
                [sys.executable, "-c", FIRST_RUN], check=False, cwd=self.root, env=alone, capture_output=True, text=True
            )
        if made.returncode:
            self.app.display_warning(f"no compiled code is brought along: {made.stderr.strip()[-500:]}")
