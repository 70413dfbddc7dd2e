from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from camcomp.forces.table import Params, force
from camcomp.ground.errors import ConfigError, FileError
from camcomp.model.cutting.cut import Cut
from camcomp.model.cutting.frame import to_vector

TANGENT = np.array([[0.0, 1.0, 0.0], [0.6, -0.8, 0.0], [0.0, 0.0, -1.0]])
# Program x lies along machine y: the workpiece is turned by 90 degrees about z.
TURNED = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])


def cut() -> Cut:
    n = len(TANGENT)
    nothing = np.full(n, np.nan)
    return Cut(
        tangent=TANGENT,
        tool_axis=[0, 0, 1],
        feed=nothing,
        speed=nothing,
        depth=nothing,
        width=nothing,
        arc_length=np.arange(n),
        line=np.arange(n),
        to_machine=TURNED,
    )


def test_machine_forces_come_back_as_the_same_vectors_plunges_included(tmp_path: Path) -> None:
    file = tmp_path / "forces.csv"
    file.write_text("s_mm,fx_N,fy_N,fz_N\n0,1,2,3\n5,1,2,3\n")
    components = force(cut(), Params(file=str(file)))
    program = to_vector(components, TANGENT, [0, 0, 1])
    np.testing.assert_allclose(program @ TURNED.T, [[1, 2, 3]] * 3, atol=1e-14)
    # Feed along program +y: right is program +x, which is machine +y.
    np.testing.assert_allclose(components[0], [2.0, -1.0, 3.0], atol=1e-14)
    below = force(cut(), Params(file=str(file), on_workpiece=True))
    np.testing.assert_allclose(below, -components)


def test_path_forces_are_taken_as_they_are_and_a_changed_file_is_read_again(tmp_path: Path) -> None:
    file = tmp_path / "forces.csv"
    file.write_text("s_mm,Fr_N,Ft_N,Fz_N\n0,1,2,3\n5,1,2,3\n")
    np.testing.assert_array_equal(force(cut(), Params(file=str(file))), [[1, 2, 3]] * 3)
    file.write_text("s_mm,Fr_N,Ft_N,Fz_N\n0,10,20,30\n5,10,20,30\n")
    np.testing.assert_array_equal(force(cut(), Params(file=str(file))), [[10, 20, 30]] * 3)


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(FileError) as caught:
        force(cut(), Params(file=str(tmp_path / "forces.csv")))
    assert caught.value.rule == "CC500" and "forces.csv" in caught.value.message


def test_bytes_that_are_no_text_are_refused_in_their_cell(tmp_path: Path) -> None:
    (tmp_path / "forces.csv").write_bytes(b"s_mm,Fr_N,Ft_N,Fz_N\n0,\xff,2,3\n")
    with pytest.raises(ConfigError) as caught:
        force(cut(), Params(file=str(tmp_path / "forces.csv")))
    assert (caught.value.rule, caught.value.at.line, caught.value.at.column) == ("CC262", 2, 3)


def test_before_a_jump_the_end_of_a_motion_takes_the_row_before_it(tmp_path: Path) -> None:
    file = tmp_path / "forces.csv"
    file.write_text("s_mm,Fr_N,Ft_N,Fz_N\n0,0,0,0\n1,0,0,0\n1,9,0,0\n5,9,0,0\n")
    at = replace(cut(), arc_length=[0, 1, 1], line=[7, 7, 8], ends=[False, True, False])
    np.testing.assert_array_equal(force(at, Params(file=str(file)))[:, 0], [0, 0, 9])
