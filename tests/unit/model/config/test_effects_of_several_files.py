"""Entries of `effects:` in several config files: a later file replaces the same entry, and keeps the others."""

import pytest

from camcomp.ground.errors import ConfigError
from camcomp.ground.files import shipped
from camcomp.model.config.load import load_config
from camcomp.model.config.write_back import carried

ORTHOGLIDE = shipped("config/orthoglide.yaml")
FIRST = """effects:
  - {effect: backlash, target: x, width_mm: 0.01}
  - {effect: screw_cyclic, target: y, pitch_mm: 5, amplitude_mm: 0.002, phase_rad: 0}
  - {effect: gravity, weight_N: 40}
"""
LATER = """effects:
  - {effect: gravity, weight_N: {value: 55, sd: 1}}
  - {effect: screw_cyclic, target: y, pitch_mm: 10, amplitude_mm: 0.001, phase_rad: 0}
"""


def effects(tmp_path, *texts):
    files = []
    for k, text in enumerate(texts):
        files.append(tmp_path / f"{k}.yaml")
        files[-1].write_text(text)
    config = load_config([ORTHOGLIDE, *files])
    return [(each.effect, each.target, each.values) for each in config.effects]


def test_a_later_file_replaces_the_same_entry_and_keeps_the_others(tmp_path):
    found = effects(tmp_path, FIRST, LATER)
    assert [each[:2] for each in found] == [
        ("backlash", "x"),
        ("screw_cyclic", "y"),
        ("gravity", None),
        ("screw_cyclic", "y"),
    ]
    assert found[2][2]["weight_N"] == 55.0
    assert [found[k][2]["pitch_mm"] for k in (1, 3)] == [5.0, 10.0]


def test_one_for_all_and_one_for_an_actuator_exclude_each_other_across_files(tmp_path):
    with pytest.raises(ConfigError) as caught:
        effects(
            tmp_path,
            "effects: [{effect: servo_lag, time_constant_ms: 1}]",
            "effects: [{effect: servo_lag, target: x, time_constant_ms: 2}]",
        )
    at = caught.value.at
    assert caught.value.rule == "CC205" and (at.file, at.line, at.column) == (str(tmp_path / "1.yaml"), 1, 20)


class Cause:
    effect, target = "gravity", None


def test_a_cause_takes_the_entry_of_an_earlier_file_with_it():
    own = "effects:\n  - {effect: backlash, target: x, width_mm: 0.01}  # measured\n"
    text = carried(own, [FIRST], [Cause()])
    assert text.startswith(own) and "gravity" in text and "screw_cyclic" not in text
