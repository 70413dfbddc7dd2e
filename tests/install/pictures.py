"""The pictures of the how-to on FreeCAD, made by FreeCAD itself: `python -m tests.install.pictures [FOLDER]`."""

import json
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from camcomp.ground.files import shipped
from tests.commandline import ROOT

FOLDER = ROOT / "docs/pictures"
NAMES = ("job", "output", "figures")
SCREEN = "-screen 0 1000x640x24"
FORCE = (
    "Ktc_N_per_mm2: 631, Krc_N_per_mm2: 99, Kac_N_per_mm2: 273, Kte_N_per_mm: 13, Kre_N_per_mm: 10, Kae_N_per_mm: 2.8"
)


def prepared(folder):
    """A home of FreeCAD in a folder, with the add-on installed: what its scripts are told, and their environment."""
    shutil.copytree(shipped("samples/freecad"), folder / "home/.local/share/FreeCAD/Mod/camcomp")
    program = folder / "camcomp"
    program.write_text(
        f'#!/bin/sh\nexport PYTHONPATH={os.environ.get("PYTHONPATH", Path.cwd())}\nexec {sys.executable} -m camcomp "$@"\n'
    )
    program.chmod(0o755)
    machine = folder / "machine.yaml"
    text = Path(shipped("config/cartesian.yaml")).read_text()
    machine.write_text(text.replace("model: constant, Fr_N: 215, Ft_N: -10, Fz_N: -25", f"model: mechanistic, {FORCE}"))
    env = os.environ | {"HOME": str(folder / "home")}
    env.pop("PYTHONPATH", None)
    return {"folder": str(folder), "config": str(machine), "camcomp": str(program)}, env


def make(folder):
    """Write the pictures into a folder. Returns what FreeCAD prints."""
    task, env = prepared(folder)
    (folder / "window.json").write_text(json.dumps({**task, "tests": str(Path(__file__).parent)}))
    env |= {"WINDOW": str(folder / "window.json"), "QTWEBENGINE_DISABLE_SANDBOX": "1", "LIBGL_ALWAYS_SOFTWARE": "1"}
    script = Path(__file__).with_name("freecad_window.py")
    command = ["timeout", "150", "xvfb-run", "-a", "-s", SCREEN, "freecad", str(script)]
    done = subprocess.run(command, env=env, capture_output=True, text=True, stdin=subprocess.DEVNULL, check=False)
    return done.stdout[-3000:] + done.stderr[-3000:]


def main(target):
    """Make the pictures in a folder of their own and copy them."""
    with tempfile.TemporaryDirectory() as work:
        said = make(Path(work))
        for name in NAMES:
            made = Path(work) / f"freecad-{name}.png"
            if not made.exists():
                sys.exit(said)
            print(shutil.copy(made, target))


if __name__ == "__main__":
    main(Path(sys.argv[1]) if sys.argv[1:] else FOLDER)
