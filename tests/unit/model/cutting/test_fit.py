import numpy as np
import pytest

from camcomp.ground.errors import ConfigError
from camcomp.model.cutting.average import linear_edge, to_path
from camcomp.model.cutting.fit import fit_slot

CHIP = np.array([0.02, 0.05, 0.08, 0.11])


@pytest.mark.parametrize("clockwise", [True, False])
def test_coefficients_that_made_the_forces_are_found_again(clockwise: bool) -> None:
    cutting, edge = (812.0, 260.0, -140.0), (21.0, 17.0, 3.5)
    made = linear_edge(chip=CHIP, depth=np.full(4, 2.5), teeth=3, start=0.0, stop=np.pi, cutting=cutting, edge=edge)
    fit = fit_slot(CHIP, to_path(made, clockwise), depth_mm=2.5, teeth=3, clockwise=clockwise)
    np.testing.assert_allclose(fit.cutting, cutting, rtol=1e-10)
    np.testing.assert_allclose(fit.edge, edge, rtol=1e-10)
    np.testing.assert_allclose(fit.r2, 1.0)


def test_params_are_keys_of_the_mechanistic_model() -> None:
    from camcomp.forces.mechanistic import Params

    fit = fit_slot(CHIP, np.outer(CHIP, [-900.0, -300.0, -100.0]) - 10, depth_mm=1, teeth=2)
    assert Params(**fit.params()).Ktc_N_per_mm2 == pytest.approx(4 * 900 / 2)


@pytest.mark.parametrize(
    ("chip", "force", "depth", "teeth"),
    [
        ([0.1], np.ones((1, 3)), 1, 2),
        ([0.1, 0.1], np.ones((2, 3)), 1, 2),
        ([0.1, 0.2], np.full((2, 3), np.nan), 1, 2),
        ([0.1, 0.2], np.ones((3, 3)), 1, 2),
        ([0.1, 0.2], np.ones((2, 3)), 0, 2),
        ([0.1, 0.2], np.ones((2, 3)), 1, 0),
        ([0.0, 0.2], np.ones((2, 3)), 1, 1),
    ],
)
def test_a_fit_without_enough_data_is_refused(chip: list, force: np.ndarray, depth: float, teeth: int) -> None:
    with pytest.raises(ConfigError) as caught:
        fit_slot(chip, force, depth_mm=depth, teeth=teeth)
    assert caught.value.rule == "CC265"
