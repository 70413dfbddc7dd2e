"""Promises of every force model of the shelf, whatever its physics."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from camcomp.ground import shelf
from camcomp.model.config.base import Spec
from camcomp.model.cutting.cut import Cut

N = 6
EXAMPLES: dict[str, dict[str, Any]] = {
    "none": {},
    "constant": {"Fr_N": 215.0, "Ft_N": -10.0, "Fz_N": -25.0},
    "mechanistic": {
        "Ktc_N_per_mm2": 958.86, "Krc_N_per_mm2": 250.86, "Kac_N_per_mm2": 146.36,
        "Kte_N_per_mm": 15.758, "Kre_N_per_mm": 19.434, "Kae_N_per_mm": 18.207, "milling": "down",
    },
    "kienzle": {"kc11_N_per_mm2": 641.0, "mc": 0.27, "radial_ratio": 0.3, "axial_ratio": 0.1, "milling": "up"},
    "table": {"file": "forces.csv"},
}  # fmt: skip
UNITLESS = {"mc", "radial_ratio", "axial_ratio", "milling", "spindle", "file", "on_workpiece", "source"}


@pytest.fixture(params=shelf.members("forces"))
def model(request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[Any, Any]:
    (tmp_path / "forces.csv").write_text("s_mm,Fr_N,Ft_N,Fz_N\n0,1,2,3\n100,-4,5,6\n")
    monkeypatch.chdir(tmp_path)
    module = shelf.load("forces", request.param)
    return module, module.Params(**EXAMPLES[request.param])


def cut(rows: Any = slice(None), turn: float = 0.0) -> Cut:
    angle = np.linspace(0, 5, N) + turn
    tangent = np.stack([np.cos(angle), np.sin(angle), np.zeros(N)], axis=1)
    return Cut(
        tangent=tangent[rows], tool_axis=[0, 0, 1], feed=np.linspace(300, 900, N)[rows], speed=np.full(N, 6000.0)[rows],
        depth=np.linspace(0, 3, N)[rows], width=np.linspace(5, 25, N)[rows], arc_length=np.linspace(0, 99, N)[rows],
        line=np.arange(N)[rows], diameter_mm=25.0, teeth=2,
    )  # fmt: skip


def test_every_shipped_model_is_tested() -> None:
    assert set(shelf.members("forces")) >= set(EXAMPLES)


def test_force_has_a_finite_row_per_point_even_for_none(model: tuple[Any, Any]) -> None:
    module, params = model
    force = module.force(cut(), params)
    assert force.shape == (N, 3) and np.isfinite(force).all()
    assert module.force(cut(slice(0)), params).shape == (0, 3)


def test_a_row_depends_on_its_own_point_only(model: tuple[Any, Any]) -> None:
    module, params = model
    rows = [4, 1, 2]
    np.testing.assert_array_equal(module.force(cut(rows), params), module.force(cut(), params)[rows])


def test_components_do_not_depend_on_where_the_feed_points(model: tuple[Any, Any]) -> None:
    module, params = model
    np.testing.assert_allclose(module.force(cut(turn=1.0), params), module.force(cut(), params), rtol=1e-12, atol=1e-12)


def test_sources_and_parameters_are_documented(model: tuple[Any, Any]) -> None:
    module, _ = model
    assert issubclass(module.Params, Spec) and len(module.SOURCES) > 15 and module.__doc__ and module.force.__doc__
    for name, field in module.Params.model_fields.items():
        assert field.description, name
        assert name in UNITLESS or name.endswith(("_N", "_N_per_mm", "_N_per_mm2", "_deg")), name


def test_unknown_parameters_and_numbers_that_are_none_are_refused(model: tuple[Any, Any]) -> None:
    module, params = model
    with pytest.raises(ValidationError):
        module.Params(**params.model_dump(), fresh=1)
    for name, value in params.model_dump().items():
        if isinstance(value, float):
            with pytest.raises(ValidationError):
                module.Params(**params.model_dump() | {name: float("nan")})
