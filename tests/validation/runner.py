"""Ask camcomp through its commands, in this process."""

from __future__ import annotations

import contextlib
import io
import json
import tempfile
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
CONFIG = ROOT / "config" / "orthoglide.yaml"


def invoke(arguments: list[str]) -> tuple[int, str]:
    """Exit code and everything printed by one camcomp command, run in this process."""
    from camcomp.terminal.cli import run as camcomp

    said = io.StringIO()
    with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
        code = camcomp(arguments)
    return code, said.getvalue()


def ask(experiment: Path, without: tuple[str, ...] = ()) -> dict[str, Any]:
    """The result JSON of `camcomp diagnose`, run in this process; raises when there is none."""
    with tempfile.TemporaryDirectory() as folder:
        answer = Path(folder) / "result.json"
        arguments = ["diagnose", str(experiment), "--json", str(answer)]
        for effect in without:
            arguments += ["--without", effect]
        code, said = invoke(arguments)
        if not answer.exists():
            raise RuntimeError(f"exit {code}: {said.strip()[-400:]}")
        return json.loads(answer.read_text())
