"""Promises of every file of config/materials."""

import re
from pathlib import Path

import pytest

from camcomp.ground.files import shipped
from camcomp.model.config.load import check_config, load_config

FILES = sorted(shipped("config/materials").glob("*.yaml"))


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_a_material_can_be_laid_over_a_machine(file: Path) -> None:
    check_config([file])
    force = load_config([shipped("config/orthoglide.yaml"), file]).process.force
    model, *words = file.stem.split("-")
    assert force.model == model
    assert force.source is not None and len(force.source) > 20
    if model == "kienzle":
        # kc1.1 and mc of metals that are milled; a swapped or shifted table row falls out of it or out of its group.
        assert 600 <= force.params.kc11_N_per_mm2 <= 3500 and 0.17 <= force.params.mc <= 0.31
        assert force.params.radial_ratio is None and force.params.axial_ratio is None
        group = re.search(r"group (\d+)", force.source)
        named = [word for word in words if word.startswith("vdi")]
        assert [f"vdi{int(group[1]):02}" if group else None] == (named or [None])


def test_the_editions_that_disagree_on_titanium_are_kept_apart() -> None:
    values = {}
    for edition in ("2017", "2022"):
        file = shipped(f"config/materials/kienzle-titanium-alpha-beta-vdi37-iscar{edition}.yaml")
        params = load_config([shipped("config/orthoglide.yaml"), file]).process.force.params
        values[edition] = (params.kc11_N_per_mm2, params.mc)
    assert values == {"2017": (2110, 0.22), "2022": (1245, 0.24)}


def test_no_group_of_the_table_is_left_out() -> None:
    groups = {int(number) for file in FILES for number in re.findall(r"vdi(\d+)", file.stem)}
    # 24, 27, 28, 34 and 35 have the values of the group before them and share its file.
    assert groups == {*range(1, 24), 25, 26, 31, 32, 33, 36, 37}
