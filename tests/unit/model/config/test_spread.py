"""Numbers that are not known exactly: what may be written where, what counts as one, and what is refused."""

import json
from pathlib import Path

import jsonschema
import pytest

from camcomp.ground.errors import ConfigError
from camcomp.ground.files import shipped
from camcomp.model.config.in_force import values_in_force
from camcomp.model.config.load import check_config, load_config, varied
from camcomp.model.config.schema import config_schema
from camcomp.model.config.spread import uncertain_inputs

BASE = shipped("config/orthoglide.yaml")


def laid(tmp_path: Path, text: str, *more: str):
    """The sample machine with YAML texts laid over it."""
    files = []
    for k, each in enumerate((text, *more)):
        files.append(tmp_path / f"{k}.yaml")
        files[-1].write_text(each)
    return load_config([BASE, *files])


def refusals(tmp_path, text):
    with pytest.raises(ConfigError) as raised:
        laid(tmp_path, text)
    return [(each.rule, each.at.line, each.at.column) for each in raised.value.all()]


def test_a_deviation_and_an_interval_leave_the_value_where_it_is(tmp_path):
    config = laid(
        tmp_path, "process: {force: {Fr_N: {value: 215, sd: 43}, Ft_N: {low: -12, high: -8}, Fz_N: {low: -30, value: -25, high: -22}}}"
    )  # fmt: skip
    params = config.process.force.params
    assert (params.Fr_N, params.Ft_N, params.Fz_N) == (215.0, -10.0, -25.0)
    assert [each.sd for each in config.spreads] == pytest.approx([43.0, 2.0 / 1.959964, 4.0 / 1.959964])


def test_an_sd_alone_belongs_to_the_number_of_the_other_file(tmp_path):
    config = laid(tmp_path, "process: {force: {Fr_N: {sd: 43}}}", "process: {force: {Fr_N: {value: 200}}}")
    (spread,) = config.spreads
    assert (spread.value, spread.sd) == (200.0, 43.0)
    assert laid(tmp_path, "process: {force: {Fr_N: {sd: 43}}}", "process: {force: {Fr_N: 200}}").spreads == ()


def test_what_anchors_repeat_is_one_number_and_a_group_is_one_draw(tmp_path):
    text = BASE.read_text().replace("stiffness_N_per_mm: 1.0e+4", "stiffness_N_per_mm: {value: 1.0e+4, sd: 1000}")
    machine = tmp_path / "machine.yaml"
    machine.write_text(text)
    over = tmp_path / "over.yaml"
    over.write_text("process: {force: {Fr_N: {sd: 20, group: cut}, Fz_N: {sd: 3, group: cut}, Ft_N: {sd: 0}}}")
    config = load_config([machine, over])
    inputs = uncertain_inputs(config.spreads)
    assert [(each.name, len(each.members)) for each in inputs] == [
        ("robot.chains.x.elements[1].stiffness_N_per_mm", 3), ("cut", 2),
    ]  # fmt: skip
    drawn = varied(config, inputs[1], 2.0).process.force.params
    assert (drawn.Fr_N, drawn.Ft_N, drawn.Fz_N) == (255.0, -10.0, -19.0)
    softer = varied(config, inputs[0], -1.0).robot.actuators
    assert {each.stiffness for each in softer.values()} == {9000.0}


def test_an_entry_of_a_list_and_a_parameter_of_an_effect(tmp_path):
    config = laid(
        tmp_path,
        "workpiece: {origin_mm: [{value: -73, sd: 0.1}, -73.205, -173.205]}\n"
        "effects: [{effect: backlash, target: x, width_mm: {value: 0.02, sd: 0.03}}]",
    )
    assert config.workpiece.origin_mm[0] == -73.0 and config.effects[0].values["width_mm"] == 0.02
    shown = {name: text for name, text, _ in values_in_force(config)}
    assert shown["workpiece.origin_mm"].endswith("(sd 0.1)") and shown["effects[1].width_mm"] == "0.02 (sd 0.03)"
    assert varied(config, uncertain_inputs(config.spreads)[1], -1.0) is None  # a width below zero
    assert varied(config, uncertain_inputs(config.spreads)[1], 1.0).effects[0].values["width_mm"] == 0.05


@pytest.mark.parametrize(
    ("text", "rule", "line", "column"),
    [
        ("process: {force: {Fr_N: {value: 1, sd: -1}}}", "CC205", 1, 40),
        ("process: {force: {Fr_N: {value: 1, sd: 1, goup: a}}}", "CC201", 1, 43),
        ("process: {force: {Fr_N: {value: 1, sd: x}}}", "CC204", 1, 40),
        ("process: {force: {Fr_N: {value: 1, sd: 1, group: 3}}}", "CC204", 1, 50),
        ("process: {force: {Fr_N: {value: 1}}}", "CC203", 1, 25),
        ("process: {force: {Fr_N: {low: 1, sd: 1}}}", "CC215", 1, 26),
        ("process: {force: {Fr_N: {value: 1, low: 1, high: 3, sd: 1}}}", "CC215", 1, 36),
        ("process: {force: {Fr_N: {low: 3, high: 1}}}", "CC209", 1, 25),
        ("process: {force: {Fr_N: {low: 1, value: 5, high: 3}}}", "CC209", 1, 25),
        ("tool: {teeth: {value: 2, sd: 1}}", "CC284", 1, 23),
        ("control: {acceleration_mm_per_s2: {value: 2, sd: 1}}", "CC284", 1, 35),
        ("tool: {diameter_mm: {value: -2, sd: 1}}", "CC205", 1, 29),
    ],
)
def test_what_is_wrong_is_told_with_its_place(tmp_path, text, rule, line, column):
    assert (rule, line, column) in refusals(tmp_path, text)


def test_an_override_is_checked_without_its_machine(tmp_path):
    path = tmp_path / "over.yaml"
    path.write_text("process: {force: {model: constant, Fr_N: {value: 1, sd: 2}, Ft_N: 0, Fz_N: 0}}")
    check_config([path])
    path.write_text("process: {force: {model: constant, Fr_N: {value: 1, sd: -2}, Ft_N: 0, Fz_N: 0}}")
    with pytest.raises(ConfigError, match="not negative"):
        check_config([path])


def test_the_schema_knows_uncertain_numbers_where_they_may_stand():
    check = jsonschema.Draft7Validator(json.loads(json.dumps(config_schema())))
    good = {
        "process": {
            "force": {"model": "constant", "Fr_N": {"value": 1, "sd": 2}, "Ft_N": 0, "Fz_N": {"low": 0, "high": 1}}
        }
    }
    assert check.is_valid(good)
    assert check.is_valid({"tool": {"length_mm": {"value": 100, "sd": 0.1, "group": "a"}}})
    for bad in ({"tool": {"teeth": {"value": 2, "sd": 1}}}, {"control": {"resolution_mm": {"value": 1, "sd": 1}}},
                {"tool": {"length_mm": {"value": 1}}}, {"tool": {"length_mm": {"value": 1, "sd": 1, "so": 1}}}):  # fmt: skip
        assert not check.is_valid(bad), bad
