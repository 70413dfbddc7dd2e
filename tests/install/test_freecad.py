"""Programs of FreeCAD's posts, and the add-on of samples/freecad in FreeCAD itself."""

import json
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from camcomp.api.machine import load_machine
from camcomp.gcode.interpret import read_program
from camcomp.gcode.setup import Setup
from camcomp.ground.datatypes import RAPID
from camcomp.ground.errors import ProgramError
from camcomp.model.from_program import job_of_program
from tests.install import pictures

POSTS = ("linuxcnc", "grbl", "mach3_mach4", "centroid", "dynapath", "smoothie", "uccnc")
NO_G20 = "uccnc"  # leaves the unit to the profile of the control
THROUGH = (
    ("box", "linuxcnc", ""),
    ("cylinder", "mach3_mach4", ""),
    ("wedge", "smoothie", ""),
    ("box", NO_G20, "--inches"),
)
HALF_DECIMAL = {"mm": (0.0006, 0.06), "inch": (0.0014, 1.3)}  # mm and mm/min: 3 and 1 decimals, 4 and 1 in inch
HEAD = "(Exported by FreeCAD)\n(Post Processor: {post}_post)\n(Begin preamble)\nG17 G90\n{unit}\n(Begin operation: G54)\nG54\n"
WRITTEN = {  # by hand, in the form of FreeCAD 0.20
    "linuxcnc in mm": HEAD.format(post="linuxcnc", unit="G21")
    + "(TC: Default Tool)\n(begin toolchange)\nM5\nM6 T1 \nG43 H1 \nM3 S8000 \n(begin operation: Profile)\nG0 Z15.000\n"
    + "G0 X-2.540 Y25.400\nG1 X-2.540 Y25.400 Z5.080 F254.000\nG2 X0.000 Y27.940 Z5.080 I2.540 J0.000 K0.000 F508.000\nM2\n",
    "grbl in inch": HEAD.format(post="grbl", unit="G20")
    + "(Begin toolchange)\n( M6 T1 )\nM3 S8000\nG0 Z0.5906\nG0 X-0.1000 Y1.0000\nG1 X-0.1000 Y1.0000 Z0.2000 F10.0000\n"
    + "G2 X0.0000 Y1.1000 Z0.2000 I0.1000 J0.0000 K0.0000 F20.0000\nM2\n",
}


def feeds(data, name, unit_mm=1.0):
    """End points (k, 3) mm of feed moves, and kinds and feeds (k, 2). unit_mm: of a program without a unit code."""
    path = read_program(data, name=name, setup=Setup(unit_mm=unit_mm)).path
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
            name = f"{post}-{unit}.nc"
            step = 0.0128 if name == f"{NO_G20}-inch.nc" else step  # it writes three decimals there, too
            ends, mine = feeds((tmp_path / name).read_bytes(), name, 25.4 if unit == "inch" else 1.0)
            assert ends == pytest.approx(wanted, abs=2 * step), name
            assert mine[:, 0].tolist() == how[:, 0].tolist(), name
            assert mine[:, 1] == pytest.approx(how[:, 1], abs=2 * feed_step), name
    with pytest.raises(ProgramError) as caught:  # its unit stands in a comment only
        job_of_program(load_machine(tmp_path / "machine.yaml"), (tmp_path / f"{NO_G20}-inch.nc").read_bytes(), "p.nc")
    assert caught.value.rule == "CC147"
    for _, post, _ in THROUGH:
        assert said[post] == "written", said[post]
    for post, unit, unit_mm in (("linuxcnc", "mm", 1.0), (NO_G20, "inch", 25.4)):
        before, _ = feeds((tmp_path / f"{post}-{unit}.nc").read_bytes(), "before.nc", unit_mm)
        moved, _ = feeds((tmp_path / f"camcomp-box-{post}.nc").read_bytes(), "box.nc", unit_mm)
        beyond = np.abs([moved.max(axis=0) - before.max(axis=0), moved.min(axis=0) - before.min(axis=0)])
        assert 2e-4 < beyond.max() < 0.02, (post, beyond)  # mm, of 34 N at 20 000 N/mm: the force of the stock
    for stock, post, _ in THROUGH:
        assert "camcomp" in (tmp_path / f"camcomp-{stock}-{post}.nc").read_text()[:200]


@pytest.mark.ecosystem
@pytest.mark.skipif(not (shutil.which("freecad") and shutil.which("xvfb-run")), reason="needs FreeCAD and Xvfb")
def test_the_window_lists_the_add_on_and_shows_the_figures(tmp_path):
    said = pictures.make(tmp_path)
    assert [name for name in pictures.NAMES if not (tmp_path / f"freecad-{name}.png").exists()] == [], said
    assert "camcomp" in (tmp_path / "part.nc").read_text().split("\n")[0]


def in_freecad(folder):
    """Posts of FreeCAD in a folder, with the add-on where FreeCAD looks for add-ons."""
    task, env = pictures.prepared(folder)
    env["JOB"] = str(folder / "job.json")
    (folder / "job.json").write_text(json.dumps({**task, "posts": POSTS, "through": THROUGH}))
    job = Path(__file__).with_name("freecad_job.py")
    command = ["freecadcmd", str(job)]
    done = subprocess.run(
        command, env=env, capture_output=True, text=True, stdin=subprocess.DEVNULL, timeout=400, check=False
    )
    out = folder / "job.json.out"
    assert out.exists(), done.stdout[-3000:] + done.stderr[-3000:]
    return json.loads(out.read_text())
