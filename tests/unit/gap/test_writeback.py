"""Causes into a machine file: comments stay, effects already there stay, what is unknown stays out."""

from camcomp.writeback import with_causes

TEXT = """# a machine
robot:
  name: m   # its name
effects:
  - {effect: gravity, weight_N: 20}   # weighed
"""
CAUSES = [
    {"effect": "backlash", "target": "x", "parameters": {"width_mm": {"value": 0.012, "ci95": [0.011, 0.013]}}},
    {"effect": "unknown", "target": None, "parameters": {}},
]


def test_comments_and_former_effects_stay_and_the_cause_is_added():
    out = with_causes(TEXT, CAUSES)
    assert "# a machine" in out and "# its name" in out and "# weighed" in out
    assert "effect: gravity, weight_N: 20" in out
    assert "- effect: backlash" in out and "target: x" in out and "width_mm: 0.012" in out
    assert "unknown" not in out and "0.011 to 0.013" in out


def test_a_file_without_effects_gains_the_section():
    out = with_causes("robot:\n  name: m\n", CAUSES)
    assert out.index("robot:") < out.index("effects:") < out.index("backlash")


def test_what_is_written_reads_back():
    from ruamel.yaml import YAML

    tree = YAML(typ="safe").load(with_causes(TEXT, CAUSES))
    assert tree["effects"] == [{"effect": "gravity", "weight_N": 20}, {"effect": "backlash", "target": "x", "width_mm": 0.012}]
