"""The force on a tool that stops in its cut, or moves along its axis, is not determined: no chip says which way."""

import numpy as np
import pytest

from camcomp.model.config.load import load_config
from camcomp.model.control import open_program
from camcomp.model.cutting.track import lay_track
from camcomp.model.job import Job
from camcomp.model.motion.alignment import align
from camcomp.model.motion.driven_path import _held_at_rest, cutting_forces

RADIUS, ROW_S, HELD = 20.0, 0.02, 25
CIRCLE = "G21 G90 G17\nG0 X20 Y0 Z0\nG3 X20 Y0 I-20 J0 F1500\nM2\n"


@pytest.mark.parametrize("trembles_mm", [0.0, 0.004])  # as measured tips do that lead the motion
def test_its_force_may_be_off_by_all_of_it_and_that_of_its_way_is_known(tmp_path, trembles_mm):
    (tmp_path / "p.nc").write_text(CIRCLE)
    config = load_config(["config/cartesian.yaml"])
    path = open_program(str(tmp_path / "p.nc"), config).path
    angle = np.arange(0.0, 2.0 * np.pi, 25.0 * ROW_S / RADIUS)
    half = len(angle) // 2
    angle = np.concatenate([angle[:half], np.full(HELD, angle[half]), angle[half:]])
    angle = angle + np.random.default_rng(5).normal(0.0, trembles_mm / RADIUS, len(angle))
    tip = np.column_stack([RADIUS * np.cos(angle), RADIUS * np.sin(angle), 0.0 * angle])
    found = align(path, tip, np.full(len(tip), 3.0))
    forces = cutting_forces(
        lay_track(path, Job(config).conditions),
        found,
        tip,
        ROW_S * np.arange(len(tip)),
        np.zeros(len(path), bool),
        logged_line=True,
    )
    size, doubt = (np.linalg.norm(each, axis=1) for each in (forces.force, forces.doubt))
    held, on_its_way = slice(half + 1, half + HELD - 1), np.r_[5 : half - 5, half + HELD + 5 : len(tip) - 5]
    assert size[held].min() > 10.0
    assert (doubt[held] >= size[held]).all()
    assert doubt[on_its_way].max() < 0.1 * size.max()
    turns = np.diff(np.unwrap(np.arctan2(forces.force[:, 1], forces.force[:, 0]))[3:-3])
    assert np.abs(turns).max() < 0.1 and np.abs(turns[half : half + HELD - 10]).max() < 0.01


@pytest.mark.parametrize("mm_per_s", [0.05, 0.15, 2.0])
def test_what_creeps_is_on_its_way(mm_per_s):
    """Within a tenth of a second it goes no further than a tip trembles at rest."""
    time = ROW_S * np.arange(500)
    tip = np.random.default_rng(6).normal(0.0, 0.002, (500, 3)) + mm_per_s * time[:, None] * [0.6, 0.0, -0.8]
    assert np.array_equal(_held_at_rest(tip, time), tip)


def test_the_direction_of_a_force_is_unknown_for_as_long_as_the_tool_moves_along_its_axis(tmp_path):
    """Down over the side of a ball: the force turns round where the motion across the axis does, somewhere near the equator."""
    angle = np.arange(1.2, -1.2, -25.0 * ROW_S / RADIUS)
    tip = RADIUS * np.column_stack([np.cos(angle), 0.0 * angle, np.sin(angle)])
    (x, _, z), (u, _, w) = tip[0], tip[-1]
    (tmp_path / "p.nc").write_text(f"G21 G90 G18\nG0 X{x} Y0 Z{z}\nG3 X{u} Z{w} I{-x} K{-z} F1500\nM2\n")
    config = load_config(["config/cartesian.yaml"])
    path = open_program(str(tmp_path / "p.nc"), config).path
    found = align(path, tip, np.full(len(tip), 3.0))
    assert found.distance.max() < 1e-3
    forces = cutting_forces(
        lay_track(path, Job(config).conditions), found, tip, ROW_S * np.arange(len(tip)), np.zeros(len(path), bool),
        logged_line=True,
    )  # fmt: skip
    across = np.abs(forces.doubt[:, 0]) > np.abs(forces.force[:, 0])
    assert across[np.abs(angle) < 0.7].all() and not across[np.abs(angle) > 0.85].any()
