"""Commands of the page of the sample pocket print the lines that it shows."""

import shutil

from tests.documents import ROOT, Reader


def test_the_pocket_is_followed(tmp_path):
    (tmp_path / "folder").mkdir()
    reader = Reader(tmp_path / "folder", tmp_path / "tools")
    for name in ("config", "samples"):
        shutil.copytree(ROOT / name, reader.folder / name)
    page = (ROOT / "samples/pocket/README.md").read_text(encoding="utf-8")
    reader.follow(page, skip=lambda text: "simulate" in text)  # the surfaces take a minute; test_surface.py has them
    left = (reader.folder / "pocket-out.nc").read_text()
    spring = page.split("```text\n")[1].split("```")[0]
    assert spring.count("\n") == 3 and spring in left
