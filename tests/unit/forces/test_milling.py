from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from camcomp.forces import constant, kienzle, mechanistic
from camcomp.ground.errors import ConfigError
from camcomp.model.cutting.cut import Cut

COEFFICIENTS: dict[str, Any] = {
    "Ktc_N_per_mm2": 958.86, "Krc_N_per_mm2": 250.86, "Kac_N_per_mm2": 146.36,
    "Kte_N_per_mm": 15.758, "Kre_N_per_mm": 19.434, "Kae_N_per_mm": 18.207,
}  # fmt: skip


def cut(n: int = 1, **changes: Any) -> Cut:
    data: dict[str, Any] = {
        "tangent": [[1.0, 0.0, 0.0]] * n, "tool_axis": [0, 0, 1], "feed": [1200.0] * n, "speed": [6000.0] * n,
        "depth": [3.0] * n, "width": [np.nan] * n, "arc_length": np.arange(n), "line": np.arange(n),
        "diameter_mm": 25.0, "teeth": 2,
    }  # fmt: skip
    return Cut(**data | changes)


def test_constant_gives_the_triple_everywhere() -> None:
    params = constant.Params(Fr_N=215, Ft_N=-10, Fz_N=-25)
    np.testing.assert_array_equal(constant.force(cut(3), params), [[215, -10, -25]] * 3)


def test_mechanistic_slot_pushes_left_holds_back_and_pulls_down() -> None:
    force = mechanistic.force(cut(), mechanistic.Params(**COEFFICIENTS))
    # N a / 4 = 1.5, N a / pi = 6/pi, N a / 2 = 3, c = 0.1
    expected = [
        -(1.5 * 95.886 + 6 / np.pi * 15.758),
        -(1.5 * 25.086 + 6 / np.pi * 19.434),
        -(6 / np.pi * 14.636 + 3 * 18.207),
    ]
    np.testing.assert_allclose(force, [expected], rtol=1e-12)


def test_depth_scales_and_air_is_free() -> None:
    force = mechanistic.force(cut(3, depth=[3.0, 1.5, -1.0]), mechanistic.Params(**COEFFICIENTS))
    np.testing.assert_allclose(force[1], force[0] / 2)
    np.testing.assert_array_equal(force[2], 0.0)


def test_up_and_down_milling_on_both_halves_make_the_slot() -> None:
    half = {"width": [12.5]}
    up, down = (mechanistic.Params(**COEFFICIENTS, milling=side) for side in ("up", "down"))
    both = mechanistic.force(cut(**half), up) + mechanistic.force(cut(**half), down)
    np.testing.assert_allclose(both, mechanistic.force(cut(), up), rtol=1e-12)
    # Up milling holds the tool back harder; down milling pushes it away from the wall (which is right of the feed).
    assert mechanistic.force(cut(**half), up)[0, 1] < mechanistic.force(cut(**half), down)[0, 1]


def test_kienzle_takes_its_directions_from_the_ratios_and_its_size_from_the_rake() -> None:
    params = kienzle.Params(kc11_N_per_mm2=641, mc=0.27, radial_ratio=0.3, axial_ratio=0.1)
    force = kienzle.force(cut(), params)
    assert force[0, 1] == pytest.approx(0.3 * force[0, 0])
    sharp = kienzle.force(cut(), params.model_copy(update={"rake_deg": 10.0}))
    np.testing.assert_allclose(sharp, 0.9 * force)


def test_spindle_direction_turns_the_side_force_of_both_models() -> None:
    for model, params in (
        (mechanistic, COEFFICIENTS),
        (kienzle, {"kc11_N_per_mm2": 641.0, "mc": 0.27, "radial_ratio": 0.3, "axial_ratio": 0.1}),
    ):
        right = model.force(cut(), model.Params(**params))
        left = model.force(cut(), model.Params(**params, spindle="counterclockwise"))
        np.testing.assert_allclose(left, right * [-1, 1, 1])
        assert right[0, 0] < 0


@pytest.mark.parametrize("missing", ["radial_ratio", "axial_ratio"])
def test_kienzle_makes_no_ratio_up(missing: str) -> None:
    given = {"radial_ratio": 0.3, "axial_ratio": 0.1}
    del given[missing]
    with pytest.raises(ConfigError) as caught:
        kienzle.force(cut(), kienzle.Params(kc11_N_per_mm2=641, mc=0.27, **given))
    assert caught.value.rule == "CC257" and missing in caught.value.message


@pytest.mark.parametrize(("rule", "changes"), [("CC250", {"speed": [0.0]}), ("CC253", {"depth": [np.nan]})])
def test_both_models_complain_about_missing_data(rule: str, changes: dict) -> None:
    power = kienzle.Params(kc11_N_per_mm2=641, mc=0.27, radial_ratio=0.3, axial_ratio=0.1)
    for model, params in ((mechanistic, mechanistic.Params(**COEFFICIENTS)), (kienzle, power)):
        with pytest.raises(ConfigError) as caught:
            model.force(cut(**changes), params)
        assert caught.value.rule == rule


@pytest.mark.parametrize(
    ("model", "key", "value"),
    [
        (kienzle, "kc11_N_per_mm2", 0.0),
        (kienzle, "mc", 1.0),
        (kienzle, "mc", -0.1),
        (kienzle, "rake_deg", 90.0),
        (kienzle, "milling", "climb"),
        (mechanistic, "Ktc_N_per_mm2", 0.0),
        (mechanistic, "spindle", "left"),
    ],
)
def test_parameters_without_meaning_are_refused(model: Any, key: str, value: Any) -> None:
    good = COEFFICIENTS if model is mechanistic else {"kc11_N_per_mm2": 641.0, "mc": 0.27}
    model.Params(**good)
    with pytest.raises(ValidationError) as caught:
        model.Params(**good | {key: value})
    assert caught.value.errors()[0]["loc"] == (key,)


@pytest.mark.parametrize("model", ["mechanistic", "kienzle"])
def test_the_program_says_how_the_spindle_turns(model) -> None:
    module = {"mechanistic": mechanistic, "kienzle": kienzle}[model]
    keys = (
        COEFFICIENTS
        if model == "mechanistic"
        else {"kc11_N_per_mm2": 641, "mc": 0.27, "radial_ratio": 0.3, "axial_ratio": 0.1}
    )
    force = module.force(cut(4, turn=[1.0, -1.0, 0.0, np.nan]), module.Params(**keys))
    np.testing.assert_array_equal(force, force[0] * [[1, 1, 1], [-1, 1, 1], [1, 1, 1], [1, 1, 1]])
    stated = module.Params(**keys, spindle="counterclockwise")
    np.testing.assert_array_equal(module.force(cut(2, turn=[-1.0, np.nan]), stated), force[[1, 1]])
    with pytest.raises(ConfigError, match="line 1: .*M3.*counterclockwise") as caught:
        module.force(cut(2, turn=[-1.0, 1.0]), stated)
    assert caught.value.rule == "CC258"
