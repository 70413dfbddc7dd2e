"""Causes into a machine file: comments stay, effects already there stay, layout stays."""

from types import SimpleNamespace

from camcomp.model.config.write_back import machine_file, with_causes

TEXT = """# a machine
robot:
  name: m   # its name
effects:
  - {effect: gravity, weight_N: 20}   # weighed
"""
WIDTH = SimpleNamespace(value=0.012, ci95=(0.011, 0.013))
CAUSES = [SimpleNamespace(effect="backlash", target="x", parameters={"width_mm": WIDTH}, settings={})]


def test_comments_and_former_effects_stay_and_the_cause_is_added():
    out = with_causes(TEXT, CAUSES)
    assert "# a machine" in out and "# its name" in out and "# weighed" in out
    assert "effect: gravity, weight_N: 20" in out
    assert "- effect: backlash" in out and "target: x" in out and "width_mm: {value: 0.012, sd: 0.00051}" in out
    assert "0.011 to 0.013" in out


def test_a_file_without_effects_gains_the_section():
    out = with_causes("robot:\n  name: m\n", CAUSES)
    assert out.index("robot:") < out.index("effects:") < out.index("backlash")


def test_what_is_written_reads_back():
    from ruamel.yaml import YAML

    tree = YAML(typ="safe").load(with_causes(TEXT, CAUSES))
    assert tree["effects"] == [
        {"effect": "gravity", "weight_N": 20},
        {"effect": "backlash", "target": "x", "width_mm": {"value": 0.012, "sd": 0.00051}},
    ]


def test_the_file_whose_effects_count_gains_the_causes():
    machine, override, effects = (
        "robot:\n  name: m\n",
        "tool:\n  length_mm: 3\n",
        "effects:\n  - {effect: gravity, weight_N: 1}\n",
    )
    assert machine_file([machine, override]) == 0
    assert machine_file([machine, effects, override]) == 1
    assert machine_file([override]) == 0
    assert machine_file([effects, machine, effects]) == 2 and machine_file([machine, machine]) == 1


def test_a_relative_file_is_still_found_from_another_folder():
    text = "process:\n  force: {model: table, file: ../forces/a.csv}   # measured\n"
    out = with_causes(text, CAUSES, folder="/a/config", moved_to="/b")
    assert "file: ../a/forces/a.csv" in out and "# measured" in out
    assert "file: ../forces/a.csv" in with_causes(text, CAUSES, folder="/a/config", moved_to="/a/config")


def test_nothing_found_changes_nothing():
    assert with_causes(TEXT, []) == TEXT


def test_a_note_stands_above_the_causes():
    lines = with_causes(TEXT, CAUSES, note="found by someone").splitlines()
    assert lines[lines.index("  # found by someone") + 1].strip() == "- effect: backlash"


def test_a_deviation_that_is_refused_on_both_sides_is_left_out():
    found = SimpleNamespace(value=0.012, ci95=(-200.0, 200.0))
    out = with_causes(
        TEXT, [SimpleNamespace(effect="backlash", target="x", parameters={"width_mm": found}, settings={})]
    )
    assert "width_mm: 0.012 " in out
