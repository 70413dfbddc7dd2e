"""The verbs about files: validate, schema, init, explain, config."""

import json
import subprocess
from pathlib import Path

import jsonschema
import pytest
from ruamel.yaml import YAML

from camcomp.api.project import machines
from camcomp.ground import shelf
from camcomp.ground.files import shipped
from camcomp.ground.rules import RULES
from camcomp.model.config.load import load_config
from camcomp.terminal.cli import run
from tests.commandline import ROOT

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
    (tmp_path / "a.csv").write_text("t_s,act_x_mm\n0,1\n")
    text = "config: [machine.yaml]\nruns:\n  - {name: a, program: a.nc, log: a.csv, cutting: true, started_s: 0}\n"
    (tmp_path / "e.yaml").write_text(text)
    assert "ok (experiment, 1 run)" in printed("validate", tmp_path / "e.yaml")
    (tmp_path / "e.yaml").write_text(text.replace("a.csv", "b.csv").replace("a.nc", "b.nc"))
    err = printed("validate", tmp_path / "e.yaml", code=5)
    assert str(tmp_path / "b.csv") in err
    assert str(tmp_path / "b.nc") in err


MACHINE = """robot:
  name: three slides
  chains:
    arm:
      elements:
        - {type: actuator, name: x, joint: prismatic, axis: x, stiffness_N_per_mm: 20000}
        - {type: actuator, name: y, joint: prismatic, axis: y, stiffness_N_per_mm: 20000}
        - {type: actuator, name: z, joint: prismatic, axis: z, stiffness_N_per_mm: 20000}
        - type: link
          compliance_diagonal: {translation_mm_per_N: [1.0e-4, 1.0e-4, 2.0e-5], rotation_rad_per_Nmm: [5.0e-8, 5.0e-8, 5.0e-8]}
tool: {length_mm: 60}
process: {force: {model: constant, Fr_N: 100, Ft_N: -50, Fz_N: 0}}
"""
SI = "translation_mm_per_N: [1.0e-7, 1.0e-7, 2.0e-8], rotation_rad_per_Nmm: [5.0e-5, 5.0e-5, 5.0e-5]"
OWN = "translation_mm_per_N: [1.0e-4, 1.0e-4, 2.0e-5], rotation_rad_per_Nmm: [5.0e-8, 5.0e-8, 5.0e-8]"


def test_a_plausible_machine_is_not_doubted(capsys, tmp_path):
    (tmp_path / "m.yaml").write_text(MACHINE)
    files = [tmp_path / "m.yaml", *(shipped(f"config/{name}") for name in SHIPPED)]
    assert run(["validate", *map(str, files)]) == 0
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize(
    ("change", "line", "said"),
    [
        (("axis: y, stiffness_N_per_mm: 20000", "axis: y, stiffness_N_per_mm: 20000000"), 7, "unusually stiff"),
        (("axis: y, stiffness_N_per_mm: 20000", "axis: y, stiffness_N_per_mm: 20"), 7, "drive of y is unusually soft"),
        ((OWN, SI), 9, "m and N m instead of mm and N mm"),
        (("Ft_N: -50", "Ft_N: 50"), 12, "pulls the tool along its feed"),
        (("tool: {length_mm: 60}", "tool: {diameter_mm: 6}"), 11, "the tool has no length"),
        (("tool: {length_mm: 60}\n", ""), 1, "the tool has no length"),
    ],
)
def test_what_is_hardly_meant_is_a_warning_with_its_place(capsys, tmp_path, change, line, said):
    file, out = tmp_path / "m.yaml", tmp_path / "found.json"
    assert change[0] in MACHINE
    file.write_text(MACHINE.replace(*change))
    assert run(["validate", str(file), "--json", str(out)]) == 0
    (told,) = capsys.readouterr().err.splitlines()
    assert told.startswith(f"{file}:{line}:") and ": warning: " in told and said in told
    (finding,) = json.loads(out.read_text())["files"][0]["findings"]
    assert (finding["level"], finding["line"]) == ("warning", line)


def test_drives_of_arms_in_newton_metres_are_doubted(capsys, tmp_path):
    text = shipped("config/kuka-kr210.yaml").read_text()
    assert "stiffness_Nmm_per_rad: 2.207e+9" in text
    (tmp_path / "arm.yaml").write_text(
        text.replace("stiffness_Nmm_per_rad: 2.207e+9", "stiffness_Nmm_per_rad: 2.207e+6")
    )
    run(["validate", str(tmp_path / "arm.yaml")])
    assert "is the value in N m/rad?" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("text", "rule", "line", "code"),
    [
        (MACHINE.replace("constant, Fr_N: 100, Ft_N: -50, Fz_N: 0", "table, file: none.csv"), "CC500", 12, 5),
        ("process: {force: {model: table, file: none.csv}}", "CC500", 1, 5),
        (MACHINE.replace("name: y", "name: x"), "CC205", 7, 2),
        (MACHINE + "process: {depth_mm: 1}\n", "CC207", 13, 2),
        (MACHINE + "effects: [{effect: backlash, target: q, width_mm: 0.1}]\n", "CC205", 13, 2),
    ],
)
def test_validate_finds_what_a_run_would_find(printed, tmp_path, text, rule, line, code):
    (tmp_path / "m.yaml").write_text(text)
    err = printed("validate", tmp_path / "m.yaml", code=code)
    assert f"{tmp_path / 'm.yaml'}:{line}:" in err and f"error[{rule}]" in err


def test_validate_reads_the_logs_of_an_experiment(printed, tmp_path):
    (tmp_path / "machine.yaml").write_bytes(shipped("config/cartesian.yaml").read_bytes())
    (tmp_path / "a.csv").write_text("t_s,act_x_mm\n0,1\n0.1,two\n")
    (tmp_path / "e.yaml").write_text("config: [machine.yaml]\nruns: [{name: a, log: a.csv, cutting: false}]\n")
    err = printed("validate", tmp_path / "e.yaml", code=2)
    assert f"{tmp_path / 'a.csv'}:3:5: error[CC403]" in err


@pytest.mark.parametrize(
    "data",
    [b"# Notes\n\nWe cut at G1 speed.\nNothing else.\nSee there.\nAnd here.\n", b"\x89PNG\r\n\x1a\n\0\0G1 X1", b'{"a": 1}', b"a,b\n1,2\n",
     b"robot:\n  name: x\n"],
)  # fmt: skip
def test_what_is_no_program_is_called_none(printed, tmp_path, data):
    (tmp_path / "file.txt").write_bytes(data)
    err = printed("validate", tmp_path / "file.txt", code=3)
    assert "error[CC141]: this is no NC program" in err and len(err.splitlines()) == 2


def test_a_program_with_a_mistake_stays_a_program(printed, tmp_path):
    for text in ("%\nO1000\nG21 G90\nG1 X1,5 F100\n", "(part)\n#1=5\nG1 X[#1+] F10\n", "N10 G1 X1 F10\nN20 G1 XX\n"):
        (tmp_path / "file.txt").write_text(text)
        assert "CC141" not in printed("validate", tmp_path / "file.txt", code=3)


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


STARTS = [each.name for each in machines()]


def test_init_lists_every_machine_with_its_source(printed):
    out = printed("init", "--list")
    robots = [name for name in SHIPPED if "\nrobot:" in shipped(f"config/{name}").read_text()]
    assert [line.split()[0] + ".yaml" for line in out.splitlines()] == robots
    assert {"hexapod", "delta", "kuka-kr210", "orthoglide"} <= set(STARTS)
    assert "genhexkins" in next(line for line in out.splitlines() if line.startswith("hexapod "))
    assert "no source stated" not in out


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(each, marks=() if each in ("delta", "kuka-kr210", "router") else pytest.mark.campaign)
        for each in STARTS
    ],
)
def test_a_project_starts_from_every_machine(printed, tmp_path, name):
    printed("init", "--machine", name, tmp_path)
    text = (tmp_path / "machine.yaml").read_text()
    assert text.startswith(shipped(f"config/{name}.yaml").read_text())
    extra = text[text.index("# --- further keys") :].splitlines()[1:]
    (tmp_path / "extra.yaml").write_text("\n".join(line.removeprefix("# ") for line in extra))
    load_config([tmp_path / "machine.yaml", Path(tmp_path / "extra.yaml")])
    summary = tmp_path / "summary.json"
    printed("compensate", tmp_path / "groove.nc", "--config", tmp_path / "machine.yaml", "--summary", summary)
    assert json.loads(summary.read_text())["after"]["max_um"] < 1.0


def test_init_refuses_what_it_cannot_start_from(printed, tmp_path):
    told = printed("init", "--machine", "hexpod", tmp_path / "a", code=2)
    assert "CC219" in told and "did you mean hexapod" in told
    assert "ask for --list" in printed("init", code=2)
    assert "two machines" in printed("init", "--machine", "delta", "--from-urdf", "a.urdf", tmp_path / "a", code=2)
    assert not (tmp_path / "a").exists()


def test_the_tutorial_is_written_with_all_that_it_needs(printed, tmp_path):
    new = tmp_path / "tutorial"
    printed("tutorial", new)
    for folder in ("config", "docs", "samples"):
        shown = {each.relative_to(new) for each in (new / folder).rglob("*") if each.is_file()}
        listed = subprocess.run(
            ["git", "ls-files", folder], check=True, cwd=ROOT, capture_output=True, text=True
        ).stdout
        assert {Path(each) for each in listed.splitlines()} <= shown
        assert all((new / each).read_bytes() == (ROOT / each).read_bytes() for each in shown)
    printed("validate", new / "samples/diagnosis/clear/experiment.yaml")
    printed("tutorial", new, code=5)


def test_shelves_of_the_schema_are_complete(schema):
    text = json.dumps(schema)
    for name in (*shelf.members("forces"), *shelf.members("effects")):
        assert f'"const": "{name}"' in text
