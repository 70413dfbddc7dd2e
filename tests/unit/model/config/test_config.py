import pytest

from camcomp.ground import shelf
from camcomp.ground.errors import CamcompError, ConfigError, FileError
from camcomp.ground.files import shipped
from camcomp.model.config.base import Positive, Spec
from camcomp.model.config.load import check_config, is_experiment, load_config, load_experiment
from camcomp.model.config.robot import ChainSpec, PrismaticActuator

CARTESIAN = str(shipped("config/cartesian.yaml"))


def refused(*paths, read=load_config):
    with pytest.raises(CamcompError) as caught:
        read(list(paths))
    return caught.value.all()


@pytest.fixture
def write(tmp_path):
    def made(text, name="over.yaml"):
        (tmp_path / name).write_text(text)
        return str(tmp_path / name)

    return made


def test_later_files_win_key_by_key(write):
    config = load_config([CARTESIAN, write("tool: {length_mm: 7}\ncontrol: {start_mm: [1, 2, 3]}")])
    assert config.tool.length_mm == 7
    assert config.control.start_mm == [1, 2, 3]
    assert config.control.resolution_mm == 0.0001
    assert config.process.force.params.Fr_N == 215


def test_no_force_takes_the_force_away():
    config = load_config([CARTESIAN, str(shipped("config/no-force.yaml"))])
    assert config.process.force.model == "none"
    assert config.process.force.given == {}


def test_one_chain_of_a_machine_can_be_overridden(write):
    over = write("robot: {chains: {y: {base_error: {rotation_deg: [1, 0, 0]}}}}")
    chains = load_config([str(shipped("config/orthoglide.yaml")), over]).robot.chains
    assert [chains[name].base_error.rotation_deg for name in "xyz"] == [[0, 0, 0], [1, 0, 0], [0, 0, 0]]


def test_every_mistake_of_every_file_at_once_in_order(write):
    one = write("tool: {lenght_mm: 3}\nworkpiece: {origin_mm: [1, 2]}", "one.yaml")
    two = write("control: {resolution_mm: -1}\ncompensation: {method: x}", "two.yaml")
    broken = write("tool: [", "three.yaml")
    errors = refused(two, one, broken)
    places = [(each.rule, each.at.file.rsplit("/", 1)[1], each.at.line) for each in errors]
    assert sorted(places) == [
        ("CC200", "three.yaml", 1), ("CC201", "one.yaml", 1), ("CC205", "one.yaml", 2), ("CC205", "two.yaml", 1),
        ("CC205", "two.yaml", 2), ("CC212", "one.yaml", 1),
    ]  # fmt: skip
    assert [place[2] for place in places if place[1] == "two.yaml"] == [1, 2]
    assert [place[2] for place in places if place[1] == "one.yaml"] == [1, 1, 2]


def test_a_mistake_in_an_anchor_is_told_once(write):
    file = write("""\
robot:
  name: a
  chains:
    x: {elements: &leg [{type: actuator, joint: prismatic, axis: q}]}
    y: {elements: *leg}
""")
    assert [(each.rule, each.at.line) for each in refused(file)] == [("CC205", 4)]


def test_a_missing_file_is_told_first_and_sets_the_exit_code(write, tmp_path):
    errors = refused(write("tool: 3"), str(tmp_path / "no.yaml"))
    assert isinstance(errors[0], FileError)
    assert errors[0].exit_code == 5
    assert {each.rule for each in errors[1:]} == {"CC204", "CC212"}


def test_without_robot_a_file_is_no_machine_but_may_be_an_override(write):
    file = write("tool: {length_mm: 3}")
    assert [each.rule for each in refused(file)] == ["CC212"]
    check_config([file])
    assert [each.rule for each in refused(write("tool: {length: 3}"), read=check_config)] == ["CC202"]
    assert [each.rule for each in refused(write("robot: {name: a}"), read=check_config)] == ["CC203"]
    check_config([write("robot: {chains: {y: {base_error: {rotation_deg: [1, 0, 0]}}}}\nprocess: {force: {Fr_N: 1}}")])


def test_no_files_at_all():
    assert [each.rule for each in refused()] == ["CC212"]


@pytest.mark.parametrize("text", ["- 1", "3", "~"])
def test_a_file_that_is_no_mapping(write, text):
    assert [(each.rule, each.at.line) for each in refused(write(text), read=check_config)] == [("CC218", 1)]


def test_places_of_values(write):
    over = write("# c\ntool: {length_mm: 7}")
    config = load_config([CARTESIAN, over])
    at = config.at("tool", "length_mm")
    assert (at.file, at.line, at.column) == (over, 2, 19)
    assert config.at("control", "resolution_mm").file == CARTESIAN


class Params(Spec):
    """A robot of one slide."""

    length_mm: Positive


class Slide:
    """A robot plug-in as a module would be."""

    Params = Params

    @staticmethod
    def chains(params):
        slide = PrismaticActuator(type="actuator", joint="prismatic", axis="x", home_mm=params.length_mm)
        return {"x": ChainSpec(elements=[slide])}


@pytest.fixture
def slide(monkeypatch):
    load = shelf.load
    monkeypatch.setattr(shelf, "load", lambda s, n, **k: Slide if (s, n) == ("robots", "slide") else load(s, n, **k))


@pytest.mark.usefixtures("slide")
def test_a_robot_from_its_shelf(write):
    config = load_config([write("robot: {type: slide, name: a, source: s, length_mm: 3}")])
    assert (config.robot.name, config.robot.source, config.robot.type) == ("a", "s", "slide")
    assert config.robot.actuators["x"].home == 3


@pytest.mark.usefixtures("slide")
@pytest.mark.parametrize(
    ("text", "rule", "column"),
    [
        ("robot: {type: slide, name: a, length: 3}", "CC202", 31),
        ("robot: {type: slide, name: a, length_mm: -3}", "CC205", 42),
        ("robot: {type: slide, length_mm: 3}", "CC203", 1),
        ("robot: {type: slied, name: a, length_mm: 3}", "CC213", 15),
        ("robot: {type: slide, name: a, length_mm: 3, chains: {}}", "CC215", 45),
    ],
)
def test_mistakes_in_a_robot_from_its_shelf(write, text, rule, column):
    errors = [each for each in refused(write(text)) if each.rule != "CC203" or rule == "CC203"]
    assert [(each.rule, each.at.column) for each in errors] == [(rule, column)]


EXPERIMENT = """\
config: [machine.yaml]
runs:
  - {name: air, program: a.nc, log: air.csv, cutting: false, started_s: 0}
  - {name: cut, log: sub/cut.csv, cutting: true, started_s: 60, clamping: second}
holdout: [cut]
"""


def test_an_experiment_has_paths_relative_to_itself(write, tmp_path):
    experiment = load_experiment(write(EXPERIMENT))
    assert experiment.config == [str(tmp_path / "machine.yaml")]
    assert experiment.runs[0].program == str(tmp_path / "a.nc")
    assert experiment.runs[1].program is None
    assert experiment.runs[1].log == str(tmp_path / "sub" / "cut.csv")
    assert (experiment.runs[1].clamping, experiment.holdout) == ("second", ["cut"])


@pytest.mark.parametrize(
    ("old", "new", "rule", "line"),
    [
        ("holdout: [cut]", "holdout: [cat]", "CC205", 1),
        ("name: cut", "name: air", "CC205", 1),
        ("cutting: true", "cuting: true", "CC201", 4),
        ("cutting: true", "cutting: 1", "CC204", 4),
        ("log: air.csv, ", "", "CC203", 3),
        ("started_s: 60", "started: 60", "CC202", 4),
        ("config: [machine.yaml]", "config: machine.yaml", "CC204", 1),
        ("runs:", "rnus:", "CC201", 2),
    ],
)
def test_mistakes_in_an_experiment(write, old, new, rule, line):
    with pytest.raises(ConfigError) as caught:
        load_experiment(write(EXPERIMENT.replace(old, new, 1)))
    assert (rule, line) in [(each.rule, each.at.line) for each in caught.value.all()]


def test_experiments_are_told_from_machines():
    assert is_experiment(EXPERIMENT.encode())
    assert not is_experiment(b"robot: {}\nruns: []")
    assert not is_experiment(b"a: [")
    assert is_experiment(b'\xef\xbb\xbf{"config": ["a.yaml"], "runs": []}') and is_experiment(b'{\n  "runs": []\n}')
    assert not is_experiment(b'{"robot": {}, "runs": []}') and not is_experiment(b'process: {"runs": 1}')


@pytest.mark.parametrize(
    "text", ["robot:\n", "robot: {type: }\n", "robot: {type: {a: b}}\n", "robot: {type: 5, name: x}\n"]
)
def test_a_robot_that_is_none_is_an_error_of_the_file(tmp_path, text):
    file = tmp_path / "m.yaml"
    file.write_text(text)
    with pytest.raises(ConfigError) as error:
        load_config([file])
    assert error.value.at.line == 1 and "Node(" not in str(error.value)
