"""Programs of FreeCAD's posts, and the add-on of samples/freecad in FreeCAD itself."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from camcomp.gcode.interpret import read_program
from camcomp.ground.datatypes import RAPID
from camcomp.ground.files import shipped

POSTS = ("linuxcnc", "grbl", "mach3_mach4", "centroid", "dynapath", "smoothie", "uccnc")
NO_G20 = "uccnc"  # leaves the unit to the profile of the control
THROUGH = (("box", "linuxcnc"), ("cylinder", "mach3_mach4"), ("wedge", "smoothie"))
HALF_DECIMAL = {"mm": (0.0006, 0.06), "inch": (0.0014, 1.3)}  # mm and mm/min: 3 and 1 decimals, 4 and 1 in inch
FORCE = (
    "Ktc_N_per_mm2: 631, Krc_N_per_mm2: 99, Kac_N_per_mm2: 273, Kte_N_per_mm: 13, Kre_N_per_mm: 10, Kae_N_per_mm: 2.8"
)
HEAD = "(Exported by FreeCAD)\n(Post Processor: {post}_post)\n(Begin preamble)\nG17 G90\n{unit}\n(Begin operation: G54)\nG54\n"
WRITTEN = {  # by hand, in the form of FreeCAD 0.20
    "linuxcnc in mm": HEAD.format(post="linuxcnc", unit="G21")
    + "(TC: Default Tool)\n(begin toolchange)\nM5\nM6 T1 \nG43 H1 \nM3 S8000 \n(begin operation: Profile)\nG0 Z15.000\n"
    + "G0 X-2.540 Y25.400\nG1 X-2.540 Y25.400 Z5.080 F254.000\nG2 X0.000 Y27.940 Z5.080 I2.540 J0.000 K0.000 F508.000\nM2\n",
    "grbl in inch": HEAD.format(post="grbl", unit="G20")
    + "(Begin toolchange)\n( M6 T1 )\nM3 S8000\nG0 Z0.5906\nG0 X-0.1000 Y1.0000\nG1 X-0.1000 Y1.0000 Z0.2000 F10.0000\n"
    + "G2 X0.0000 Y1.1000 Z0.2000 I0.1000 J0.0000 K0.0000 F20.0000\nM2\n",
}


def feeds(data, name):
    """End points (k, 3) mm of feed moves, and kinds and feeds (k, 2)."""
    path = read_program(data, name=name).path
    feeding = path.kind != RAPID
    return path.end[feeding], np.column_stack((path.kind[feeding], path.feed[feeding]))


@pytest.mark.parametrize("written", WRITTEN)
def test_programs_in_the_form_of_freecad_read_alike_in_mm_and_inch(written):
    ends, how = feeds(WRITTEN[written].encode(), "part.nc")
    assert ends == pytest.approx(np.array([[-2.54, 25.4, 5.08], [0.0, 27.94, 5.08]]), abs=1e-9)
    assert how[:, 1] == pytest.approx([254.0, 508.0])


@pytest.mark.ecosystem
@pytest.mark.skipif(not shutil.which("freecadcmd"), reason="FreeCAD is not installed (freecad-python3)")
def test_one_job_of_freecad_reads_alike_from_seven_posts_and_goes_through_the_add_on(tmp_path):
    said = in_freecad(tmp_path)
    assert said["listed"], "FreeCAD does not list the add-on among its posts"
    wanted, how = feeds((tmp_path / "linuxcnc-mm.nc").read_bytes(), "linuxcnc-mm.nc")
    assert len(wanted) > 10
    for post in POSTS:
        for unit, (step, feed_step) in HALF_DECIMAL.items():
            if (post, unit) == (NO_G20, "inch"):
                continue
            name = f"{post}-{unit}.nc"
            ends, mine = feeds((tmp_path / name).read_bytes(), name)
            assert ends == pytest.approx(wanted, abs=2 * step), name
            assert mine[:, 0].tolist() == how[:, 0].tolist(), name
            assert mine[:, 1] == pytest.approx(how[:, 1], abs=2 * feed_step), name
    for stock, _ in THROUGH:
        assert said[stock] == "written", said[stock]
    moved, _ = feeds((tmp_path / "camcomp-box-linuxcnc.nc").read_bytes(), "box.nc")
    beyond = np.abs([moved.max(axis=0) - wanted.max(axis=0), moved.min(axis=0) - wanted.min(axis=0)])
    assert 2e-4 < beyond.max() < 0.02  # mm, of 34 N at 20 000 N/mm: the force of the stock
    for stock, post in THROUGH:
        assert "camcomp" in (tmp_path / f"camcomp-{stock}-{post}.nc").read_text().split("\n")[0]


def in_freecad(folder):
    """Posts of FreeCAD in a folder, with the add-on where FreeCAD looks for add-ons."""
    mod = folder / "home" / ".local" / "share" / "FreeCAD" / "Mod"
    shutil.copytree(shipped("samples/freecad"), mod / "camcomp")
    program = folder / "camcomp"
    program.write_text(
        f'#!/bin/sh\nexport PYTHONPATH={os.environ.get("PYTHONPATH", Path.cwd())}\nexec {sys.executable} -m camcomp "$@"\n'
    )
    program.chmod(0o755)
    machine = folder / "machine.yaml"
    text = Path(shipped("config/cartesian.yaml")).read_text()
    machine.write_text(text.replace("model: constant, Fr_N: 215, Ft_N: -10, Fz_N: -25", f"model: mechanistic, {FORCE}"))
    task = {"folder": str(folder), "posts": POSTS, "through": THROUGH, "config": str(machine), "camcomp": str(program)}
    (folder / "job.json").write_text(json.dumps(task))
    env = os.environ | {
        "JOB": str(folder / "job.json"),
        "HOME": str(folder / "home"),
    }
    env.pop("PYTHONPATH", None)
    job = Path(__file__).with_name("freecad_job.py")
    command = ["freecadcmd", str(job)]
    done = subprocess.run(
        command, env=env, capture_output=True, text=True, stdin=subprocess.DEVNULL, timeout=400, check=False
    )
    out = folder / "job.json.out"
    assert out.exists(), done.stdout[-3000:] + done.stderr[-3000:]
    return json.loads(out.read_text())
