"""The verbs about files: validate, schema, init, explain, config."""

import json
from pathlib import Path

import jsonschema
import pytest
from ruamel.yaml import YAML

from camcomp.ground import shelf
from camcomp.ground.files import shipped
from camcomp.ground.rules import RULES
from camcomp.model.config.load import load_config
from camcomp.terminal.cli import run

MACHINES = ("orthoglide", "orthoglide-1deg", "cartesian", "puu")
SHIPPED = sorted(path.name for path in shipped("config").glob("*.yaml"))


@pytest.fixture
def printed(capsys):
    def call(*args, code=0):
        result = run([str(each) for each in args])
        out, err = capsys.readouterr()
        assert result == code, err
        return out if code == 0 else err

    return call


# --- schema -----------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def schema():
    return json.loads(shipped("config/camcomp.schema.json").read_text())


@pytest.mark.parametrize(
    ("args", "name"), [((), "camcomp.schema.json"), (("--experiment",), "camcomp-experiment.schema.json")]
)
def test_the_shipped_schema_is_the_generated_one(printed, args, name):
    assert printed("schema", *args) == shipped(f"config/{name}").read_text(), "run `camcomp schema > config/" + name


def test_the_schema_is_clean_draft_07(schema):
    clean(schema)


@pytest.mark.parametrize("kind", ["diagnosis", "summary", "verify"])
def test_the_schema_of_a_result_is_clean_too(printed, kind):
    clean(json.loads(printed("schema", "--result", kind)))


def test_one_schema_at_a_time(printed):
    assert "ask for one" in printed("schema", "--experiment", "--result", "verify", code=2)


def clean(schema):
    assert schema["$schema"] == "http://json-schema.org/draft-07/schema#"
    jsonschema.Draft7Validator.check_schema(schema)
    known = set(jsonschema.Draft7Validator.META_SCHEMA["properties"])

    def walk(node):
        if isinstance(node, list):
            for each in node:
                walk(each)
        elif isinstance(node, dict):
            assert set(node) <= known, set(node) - known
            assert "$ref" not in node or len(node) == 1
            for key, each in node.items():
                if key in ("properties", "definitions", "patternProperties"):
                    for inner in each.values():
                        walk(inner)
                elif key not in ("const", "enum", "default", "required"):
                    walk(each)

    walk(schema)


@pytest.mark.parametrize("name", SHIPPED)
def test_shipped_files_keep_to_the_schema_and_name_it(schema, name):
    text = shipped(f"config/{name}").read_text()
    assert text.startswith("# yaml-language-server: $schema=camcomp.schema.json\n")
    jsonschema.Draft7Validator(schema).validate(YAML(typ="safe", pure=True).load(text))


@pytest.mark.parametrize(
    "wrong",
    [
        {"tool": {"length": 1}},
        {"robto": {}},
        {"process": {"force": {"model": "dark"}}},
        {"process": {"force": {"model": "constant", "Fr": 1}}},
        {"effects": [{"effect": "ghost"}]},
        {"effects": [{"effect": "backlash", "width": 1}]},
        {"workpiece": {"origin_mm": [1, 2]}},
        {
            "robot": {
                "name": "a",
                "chains": {"x": {"elements": [{"type": "link", "compliance_mm_N_rad": [[1]]}]}},
            }
        },
    ],
)
def test_the_schema_refuses_what_camcomp_refuses(schema, wrong):
    assert not jsonschema.Draft7Validator(schema).is_valid(wrong)


# --- the sample machines ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", MACHINES)
def test_every_machine_runs_by_itself(name):
    config = load_config([shipped(f"config/{name}.yaml")])
    assert list(config.robot.actuators) == ["x", "y", "z"]
    force = config.process.force.params
    assert (force.Fr_N, force.Ft_N, force.Fz_N) == (215, -10, -25)
    assert config.control.resolution_mm == 0.0001


def test_the_turned_machine_differs_by_its_chains_only():
    straight, turned = (load_config([shipped(f"config/{name}.yaml")]) for name in MACHINES[:2])
    assert [each.base_error.rotation_deg for each in turned.robot.chains.values()] == [[1, 0, 0]] * 3
    chains = {name: {**dict(each), "base_error": None} for name, each in turned.robot.chains.items()}
    assert chains == {name: {**dict(each), "base_error": None} for name, each in straight.robot.chains.items()}
    for section in ("workpiece", "tool", "control", "compensation", "effects"):
        assert getattr(turned, section) == getattr(straight, section)


def test_every_physical_value_of_a_machine_has_a_source():
    for name in MACHINES:
        lines = shipped(f"config/{name}.yaml").read_text().splitlines()
        tree = YAML(typ="safe", pure=True).load("\n".join(lines))
        for chain in tree["robot"]["chains"].values():
            for element in chain["elements"]:
                assert "source" in element or element["type"] == "passive", (name, element)
        for section in ("workpiece", "tool"):
            first = next(i for i, line in enumerate(lines) if line.startswith(f"{section}:"))
            block = "\n".join(lines[first : lines.index("", first)])
            assert "source:" in block, (name, section)


# --- validate -----------------------------------------------------------------------------------------------------


def test_validate_says_ok_for_each_file(printed):
    out = printed("validate", *(shipped(f"config/{name}") for name in SHIPPED))
    assert out.count(": ok (configuration)") == len(SHIPPED)


def test_validate_tells_every_error_of_every_file(printed, tmp_path):
    (tmp_path / "a.yaml").write_text("tool: {length: 1}")
    (tmp_path / "b.yaml").write_text("tol: 1")
    err = printed("validate", tmp_path / "a.yaml", tmp_path / "b.yaml", tmp_path / "c.yaml", code=2)
    assert [f"error[{rule}]" in err for rule in ("CC202", "CC201", "CC500")] == [True] * 3


def test_validate_reads_programs(printed, tmp_path):
    good, bad = tmp_path / "good.nc", tmp_path / "bad.nc"
    good.write_text("G21 G90\nG0 X0 Y0 Z5\nG1 Z-1 F100\nM2\n")
    bad.write_text("G21 G90\nG0 X0 Y0 Z5\nG1 X1,5 F100\nM2\n")
    assert ": ok (program" in printed("validate", good)
    err = printed("validate", bad, good, tmp_path / "none.nc", code=3)
    assert f"{bad}:3:4: error[CC1" in err
    assert str(tmp_path / "none.nc") in err


def test_validate_checks_an_experiment_with_what_it_names(printed, tmp_path):
    (tmp_path / "machine.yaml").write_bytes(shipped("config/cartesian.yaml").read_bytes())
    (tmp_path / "a.nc").write_text("G21 G90\nG0 X0 Y0 Z5\nG1 X1 F100\nM2\n")
    (tmp_path / "a.csv").write_text("t_s\n0\n")
    text = "config: [machine.yaml]\nruns:\n  - {name: a, program: a.nc, log: a.csv, cutting: true, started_s: 0}\n"
    (tmp_path / "e.yaml").write_text(text)
    assert "ok (experiment, 1 runs)" in printed("validate", tmp_path / "e.yaml")
    (tmp_path / "e.yaml").write_text(text.replace("a.csv", "b.csv").replace("a.nc", "b.nc"))
    err = printed("validate", tmp_path / "e.yaml", code=5)
    assert str(tmp_path / "b.csv") in err
    assert str(tmp_path / "b.nc") in err


# --- explain, config, init --------------------------------------------------------------------------------------------


def test_explain(printed):
    out = printed("explain", "cc208")
    assert "CC208: matrix not usable" in out
    assert "positive definite" in out
    listing = printed("explain").splitlines()
    assert [line[:5] for line in listing] == sorted(RULES)
    assert "did you mean CC208" in printed("explain", "CC2008", code=2)


def test_config_show_tells_where_values_come_from(printed):
    machine, over = shipped("config/cartesian.yaml"), shipped("config/no-force.yaml")
    out = printed("config", "show", "--origin", "--config", machine, "--config", over).splitlines()
    assert f"process.force.model = none  # {over}:6" in out
    assert "control.start_mm = [0.0, 0.0, 0.0]  # default" in out
    line = next(each for each in out if each.startswith("tool.length_mm = 0"))
    number = int(line.rsplit(":", 1)[1])
    assert "length_mm: 0" in machine.read_text().splitlines()[number - 1]
    assert not [each for each in out if "Fr_N" in each]
    assert "#" not in printed("config", "show", "--config", machine)


def test_init_starts_a_project_that_is_valid_as_it_is(printed, tmp_path):
    new = tmp_path / "new" / "project"
    printed("init", new)
    assert {each.name for each in new.iterdir()} == {
        "README.md",
        "machine.yaml",
        "groove.nc",
        "camcomp.schema.json",
    }
    printed("validate", new / "machine.yaml")
    load_config([new / "machine.yaml"])
    printed("validate", new / "groove.nc", "--config", new / "machine.yaml")
    before = {each: each.read_bytes() for each in new.iterdir()}
    printed("init", new, code=5)
    assert before == {each: each.read_bytes() for each in new.iterdir()}


def test_the_commented_keys_of_a_new_project_are_real(printed, tmp_path):
    printed("init", tmp_path)
    text = (tmp_path / "machine.yaml").read_text()
    extra = text[text.index("# --- further keys") :].splitlines()[1:]
    (tmp_path / "extra.yaml").write_text("\n".join(line.removeprefix("# ") for line in extra))
    load_config([tmp_path / "machine.yaml", Path(tmp_path / "extra.yaml")])


def test_shelves_of_the_schema_are_complete(schema):
    text = json.dumps(schema)
    for name in (*shelf.members("forces"), *shelf.members("effects")):
        assert f'{{"const": "{name}"}}' in text
