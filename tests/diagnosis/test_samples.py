"""The walk through the sample experiments prints what it says."""

import shutil
import sys

from tests.documents import ROOT, Reader


def test_the_walk_through_the_samples_is_followed(tmp_path):
    (tmp_path / "folder").mkdir()
    reader = Reader(tmp_path / "folder", tmp_path / "tools")
    python = tmp_path / "tools" / "python"
    python.write_text(f'#!/bin/sh\nexec "{sys.executable}" "$@"\n')
    python.chmod(0o755)
    for name in ("config", "samples"):
        shutil.copytree(ROOT / name, reader.folder / name)
    reader.follow((ROOT / "samples/diagnosis/README.md").read_text(encoding="utf-8"))
