"""The compensation paper's figures for its Fig. 4: a circle of radius 1 mm near Q1."""

import numpy as np
import pytest

from tests.commandline import compensated


@pytest.fixture(scope="module")
def paths(tmp_path_factory):
    _, _, paths, _, _ = compensated(
        tmp_path_factory.mktemp("circle"), "samples/groove-circle-2.nc", "config/orthoglide-1deg.yaml"
    )
    on = np.abs(np.hypot(paths["target_x_mm"], paths["target_y_mm"]) - 1.0) < 1e-6
    on &= np.abs(paths["force_x_mm"] - paths["target_x_mm"]) + np.abs(paths["force_y_mm"] - paths["target_y_mm"]) > 1e-3
    names = ("target", "chain_error", "force", "both", "adjusted")
    return {name: np.column_stack((paths[f"{name}_x_mm"], paths[f"{name}_y_mm"]))[on] for name in names}


def ellipse(points, target):
    """Centre (2,) and matrix (2, 2) of the affine map that takes the unit circle of the target to the points."""
    design = np.column_stack((np.ones(len(target)), target))
    solution, *_ = np.linalg.lstsq(design, points, rcond=None)
    return solution[0], solution[1:].T


def test_the_adjusted_circle_lies_on_the_other_side_of_the_target(paths):
    for before in ("both",):
        loaded, _ = ellipse(paths[before], paths["target"])
        adjusted, _ = ellipse(paths["adjusted"], paths["target"])
        cosine = loaded @ adjusted / np.linalg.norm(loaded) / np.linalg.norm(adjusted)
        assert cosine < -0.99
        assert np.linalg.norm(adjusted) == pytest.approx(np.linalg.norm(loaded), rel=0.1)


def test_the_long_axis_of_the_loaded_ellipse_is_the_short_axis_of_the_adjusted_one(paths):
    _, loaded = ellipse(paths["both"], paths["target"])
    _, adjusted = ellipse(paths["adjusted"], paths["target"])
    long_loaded = np.linalg.svd(loaded)[0][:, 0]
    short_adjusted = np.linalg.svd(adjusted)[0][:, 1]
    assert np.linalg.svd(loaded)[1][0] / np.linalg.svd(loaded)[1][1] > 1.05
    assert np.linalg.svd(adjusted)[1][0] / np.linalg.svd(adjusted)[1][1] > 1.05
    assert abs(long_loaded @ short_adjusted) > 0.99


def test_the_loaded_path_of_imperfect_chains_crosses_the_target(paths):
    radius = np.linalg.norm(paths["both"], axis=1)
    assert radius.min() < 1.0 < radius.max()
