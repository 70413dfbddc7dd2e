"""A turned or tilted workpiece: machine coordinates are not turned with it; closed forms on the Cartesian machine."""

import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from camcomp.model.config.load import load_config
from camcomp.model.control import program_of
from tests.commandline import ROOT, table
from tests.validation.runner import invoke

CARTESIAN = ROOT / "config" / "cartesian.yaml"
G54, G55, HOME = np.array([10.0, 20.0, 0.0]), np.array([110.0, 20.0, 0.0]), np.array([200.0, 300.0, 50.0])
TURNS = {"rotation_deg": 90.0}, {"rotation_deg": 33.0}, {"rotation_vector_deg": [10.0, -20.0, 40.0]}
BEGIN = "G21 G90 G17\nS1000 M3\nG54 G0 X0 Y0 Z5\nG1 Z0 F500\nX5\n"


def config(tmp_path, turn):
    path = tmp_path / "turned.yaml"
    control = {"offsets_mm": {"G55": G55.tolist()}, "reference_positions_mm": {"G28": HOME.tolist()}}
    path.write_text(json.dumps({"workpiece": {"origin_mm": G54.tolist(), **turn}, "control": control}))
    return path


def matrix(turn):
    return Rotation.from_rotvec(turn.get("rotation_vector_deg", [0, 0, turn.get("rotation_deg", 0.0)]), degrees=True)


def compensated(tmp_path, text, *configs):
    """The joint table; the corrected program is out.nc."""
    (tmp_path / "p.nc").write_text(text)
    words = [word for each in (CARTESIAN, *configs) for word in ("--config", str(each))]
    out, joints = tmp_path / "out.nc", tmp_path / "j.csv"
    code, said = invoke(["compensate", str(tmp_path / "p.nc"), *words, "--joints", str(joints), "-o", str(out)])
    assert code == 0, said
    return table(joints)


def slides(tmp_path, text, *configs):
    """Slides (n, 3) mm of the programmed tips, which are machine coordinates on this machine."""
    columns = compensated(tmp_path, text, *configs, ROOT / "config" / "no-force.yaml")
    return np.column_stack([columns[f"act_{a}_nominal_mm"] for a in "xyz"])


@pytest.mark.parametrize("turn", TURNS, ids=str)
@pytest.mark.parametrize("stated", ["machine file", "G10"])
def test_the_origin_of_g55_is_machine_coordinates(tmp_path, turn, stated):
    text = BEGIN + ("G10 L2 P2 X110 Y20 Z0\n" if stated == "G10" else "") + "G55\nG0 X0 Y0 Z0\nG0 X5 Y2 Z0\nM30\n"
    found = slides(tmp_path, text, config(tmp_path, turn))
    np.testing.assert_allclose(found[-2], G55, atol=1e-6)
    np.testing.assert_allclose(found[-1], G55 + matrix(turn).apply([5.0, 2.0, 0.0]), atol=1e-6)
    np.testing.assert_allclose(found[2], G54 + matrix(turn).apply([5.0, 0.0, 0.0]), atol=1e-6)


@pytest.mark.parametrize("turn", TURNS, ids=str)
def test_positions_of_g53_and_g28_are_machine_coordinates(tmp_path, turn):
    text = BEGIN + "G0 Z5\nG53 G0 X40\nG0 X1 Y1 Z5\nG28 Z5\nG28 X1 Y1 Z5\nG0 X1 Y1 Z5\nM30\n"
    found = slides(tmp_path, text, config(tmp_path, turn))
    place = G54 + matrix(turn).apply([5.0, 0.0, 5.0])
    np.testing.assert_allclose(found[4], [40.0, *place[1:]], atol=1e-6)
    place = G54 + matrix(turn).apply([1.0, 1.0, 5.0])
    np.testing.assert_allclose(found[7], [*place[:2], 50.0], atol=1e-6)
    np.testing.assert_allclose(found[9], HOME, atol=1e-6)


@pytest.mark.parametrize("turn", TURNS, ids=str)
def test_the_writer_knows_where_a_move_of_one_machine_axis_leaves_the_tool(tmp_path, turn):
    """Behind it the corrected place of the other axes stays, and relative words count from there."""
    text = BEGIN + "G1 X9 Y3\nG53 G0 X40\nG91 G1 X2 Y1 F500\nG90 G0 Z5\nM30\n"
    turned = config(tmp_path, turn)
    columns = compensated(tmp_path, text, turned)
    written = np.column_stack([columns[f"{a}c_mm"] for a in "xyz"])
    again = program_of((tmp_path / "out.nc").read_bytes(), "out.nc", load_config([str(CARTESIAN), str(turned)])).path
    apart = np.abs(written[:, None] - again.end[None]).max(axis=2).min(axis=1)
    assert apart.max() < 1e-6
