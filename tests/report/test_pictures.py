"""The pictures of the documentation are those that the samples make today."""

import struct

import pytest

from tests.commandline import ROOT
from tests.report import pictures
from tests.report.browser import needs_browser


def size(path):
    """Width and height of a PNG."""
    data = path.read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    return struct.unpack(">II", data[16:24])


@pytest.mark.campaign  # pictures change when their script does
@needs_browser
def test_pictures_can_be_made_anew_and_look_as_large_as_those_that_are_shown(tmp_path):
    made = pictures.make(tmp_path)
    kept = {path.name: path for path in pictures.FOLDER.glob("*.png")}
    assert {path.name for path in made} == set(kept)
    for path in made:
        assert size(path)[0] == size(kept[path.name])[0]
        # an empty plot or an error page packs into a third of it
        assert path.stat().st_size == pytest.approx(kept[path.name].stat().st_size, rel=0.35), (
            "python -m tests.report.pictures"
        )


def test_every_picture_is_shown_somewhere():
    shown = "".join(path.read_text(encoding="utf-8") for path in (ROOT / "docs").rglob("*.md"))
    for path in pictures.FOLDER.iterdir():
        assert f"pictures/{path.name})" in shown, path.name
