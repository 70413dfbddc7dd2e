"""The pictures of the documentation, made from the samples: `python -m tests.report.pictures [FOLDER]`."""

import sys
import tempfile
from pathlib import Path

from camcomp.terminal.cli import run
from tests.commandline import ROOT
from tests.report.browser import Browser

FOLDER = ROOT / "docs/pictures"
SIZE = (1000, 900)
PAGES = {
    "compensation": (
        ["compensate", "samples/groove-circle-50.nc", "--config", "config/orthoglide-1deg.yaml", "-o", "{at}.nc"], "drawing"
    ),
    "diagnosis": (["diagnose", "samples/diagnosis/clear/experiment.yaml"], "circles"),
}  # fmt: skip


def make(folder):
    """Two pictures of every page: its first screen, and the part that it is best known by."""
    folder.mkdir(parents=True, exist_ok=True)
    made = []
    with tempfile.TemporaryDirectory() as work:
        browser = Browser(Path(work) / "profile", *SIZE)
        try:
            for name, (words, part) in PAGES.items():
                page = Path(work) / f"{name}.html"
                at = [each.format(at=Path(work) / name) for each in words]
                at = [str(ROOT / each) if "/" in each and not each.startswith("/") else each for each in at]
                assert run([*at, "--report", str(page), "--quiet"]) == 0
                browser.open(page)
                for suffix, place in (("", "main"), (f"-{part}", part)):
                    browser.run(f"document.getElementById('{place}').scrollIntoView()" if suffix else "scrollTo(0, 0)")
                    target = folder / f"{name}{suffix}.png"
                    target.write_bytes(browser.screenshot())
                    made.append(target)
        finally:
            browser.close()
    return made


if __name__ == "__main__":
    for each in make(Path(sys.argv[1]) if sys.argv[1:] else FOLDER):
        print(each)
