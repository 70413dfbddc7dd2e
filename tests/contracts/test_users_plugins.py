"""Plug-ins of a user's own, installed as a package: good ones work, bad ones are told by name and harm nobody else."""

import json
import subprocess
import sys

import numpy as np
import pytest

from camcomp.diagnosis.experiment.open_experiment import open_experiment
from camcomp.diagnosis.fit.bench import Bench, CandidateCause
from camcomp.diagnosis.fit.columns import working_causes
from camcomp.ground import shelf
from camcomp.ground.errors import ConfigError, PluginWarning, Terminated
from camcomp.terminal.cli import run
from tests.commandline import ROOT
from tests.installed import install

EFFECT = '''
"""The spindle leans."""

import numpy as np

from camcomp.plugins import Load, Motion, Parameter

STAGE = "tool"
TARGET = "machine"
SOURCE = "definition"
PARAMETERS = (Parameter("lean", "1", 0.0, -0.1, 0.1, 2e-3, 2e-6, "spindles are square to 0.1 to 5 mrad"),)


def on_pose(tip, load, motion, p):
    return tip if p["lean"] == 0.0 else tip + p["lean"] * (tip[:, 2:3] + 173.0) * np.array([1.0, 0.0, 0.0])
'''
FORCE = '''
"""A force."""

import numpy as np

from camcomp.plugins import Spec

SOURCES = "our own measurements"


class Params(Spec):
    """Constants."""

    Fr_N: float


def force(cut, params):
    return np.tile([params.Fr_N, 0.0, 0.0], (len(cut), 1))
'''
ROBOT = '''
"""A gantry."""

from camcomp.plugins import Spec


class Params(Spec):
    """Constants."""

    screw_N_per_mm: float


def chains(params):
    return {"gantry": {"elements": [
        {"type": "actuator", "name": a, "joint": "prismatic", "axis": a, "stiffness_N_per_mm": params.screw_N_per_mm,
         "limits_mm": [-500.0, 500.0]}
        for a in "xyz"]}}
'''
DIALECT = '''
"""A control."""

from dataclasses import replace

from camcomp.dialects.rs274 import DIALECT as RS274

DIALECT = replace(RS274, name="NAME", title="A control", marks=((r"^\\\\s*G187\\\\b", 20),), passed=RS274.passed | {1870})
'''.replace("\\\\\\\\", "\\\\")
CONFIG = ROOT / "config"
GOOD = {"effects": EFFECT, "forces": FORCE, "robots": ROBOT, "dialects": DIALECT}
PROGRAM = "G21 G90 G17 G94\nG0 X0 Y0 Z0\nG1 X10 F600\nG1 X10 Y10\nM2\n"
USE = {
    "effects": "effects: [{effect: NAME, lean: 0.001}]\n",
    "forces": "process: {force: {model: NAME, Fr_N: 100}}\n",
    "robots": "robot: {name: big, type: NAME, screw_N_per_mm: 9000}\n",
    "dialects": "control: {dialect: NAME}\n",
}
# Every name is used once: modules stay imported for the whole of a test run.
names = (f"plugin_{k}" for k in range(1000))


@pytest.fixture
def put(tmp_path, monkeypatch):
    """Installs a plug-in of a fresh name; the name."""
    site = tmp_path / "site"
    site.mkdir()
    monkeypatch.syspath_prepend(str(site))

    def make(shelf_name, source, **how):
        name = next(names)
        install(site, shelf_name, name, source and source.replace("NAME", name), **how)
        (tmp_path / "use.yaml").write_text(USE[shelf_name].replace("NAME", name))
        return name

    (tmp_path / "part.nc").write_text(PROGRAM)
    monkeypatch.chdir(tmp_path)
    return make


def simulate(*more, machine=True):
    given = ["--config", str(CONFIG / "cartesian.yaml")] if machine else []
    return run(["simulate", "part.nc", *given, *more, "--step-s", "0.1"])


USED = ("--config", "use.yaml")


def complaint(shelf_name, put, source, capsys, **how):
    """Listed, a bad plug-in is a warning; unused, it changes no result; used, it is an error of exit 2. What is said of it."""
    name = put(shelf_name, source, **how)
    with pytest.warns(PluginWarning, match=f"entry point {name} = ") as told:
        assert name not in dict(shelf.usable(shelf_name))
    capsys.readouterr()
    assert simulate() == 0
    rows, said = capsys.readouterr()
    assert rows.startswith("t_s,line") and (name in said) == (shelf_name == "dialects"), said
    assert simulate(*USED, machine=shelf_name != "robots") == 2
    out, said = capsys.readouterr()
    assert out == "" and "error[CC280]" in said and f"entry point {name} = " in said and f"our-{name} 1.0" in said, said
    assert said.startswith("use.yaml:1:"), said
    return str(told[0].message) + said


# --- what cannot be imported ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("source", "told"),
    [
        ("import nothing_of_this_name\n", "ModuleNotFoundError"),
        ("def on_pose(:\n", "SyntaxError"),
        ("import sys\nsys.exit('bye')\n", "SystemExit: bye"),
        ("nobody\n", "NameError"),
        ("class Odd(BaseException):\n    pass\nraise Odd()\n", "Odd"),
        (None, "ModuleNotFoundError"),
    ],
    ids=["import", "syntax", "exit", "name", "odd", "absent"],
)
@pytest.mark.parametrize("shelf_name", ["effects", "dialects"])
def test_a_plugin_that_cannot_be_imported(shelf_name, source, told, put, capsys):
    said = complaint(shelf_name, put, source, capsys)
    assert "cannot be imported" in said and told in said
    if source is not None:
        assert ".py:" in said, "the place in the plug-in is told"


def test_a_signal_while_a_plugin_is_imported_is_not_its_fault(put):
    name = put("effects", "from camcomp.ground.errors import Terminated\nraise Terminated(15)\n")
    with pytest.raises(Terminated):
        shelf.load("effects", name)


@pytest.mark.parametrize("shelf_name", list(GOOD))
def test_an_entry_point_that_is_no_module(shelf_name, put, capsys):
    assert "not a module" in complaint(shelf_name, put, "thing = 3\n", capsys, module=next(names), value="math:pi")


def test_two_packages_with_one_name(put, tmp_path):
    name = put("forces", FORCE)
    other = tmp_path / "other"
    other.mkdir()
    install(tmp_path / "site", "forces", f"{name}_2", FORCE)
    (tmp_path / "site" / f"our_{name}_2-1.0.dist-info" / "entry_points.txt").write_text(
        f"[camcomp.forces]\n{name} = {name}_2\n"
    )
    with pytest.raises(ConfigError, match="two plug-ins have one name") as caught:
        shelf.load("forces", name)
    assert caught.value.rule == "CC280" and f"our-{name}_2" in caught.value.message


def test_a_shipped_name_cannot_be_taken(put, tmp_path):
    install(tmp_path / "site", "effects", "backlash", EFFECT, module=next(names))
    with pytest.warns(PluginWarning, match="'backlash'.* belongs to camcomp's own"):
        found = dict(shelf.usable("effects"))
    assert found["backlash"].__name__ == "camcomp.effects.backlash"


# --- what breaks its contract -----------------------------------------------------------------------------------------


def changed(source, old, new):
    assert old in source
    return source.replace(old, new)


MEMORY = """MOMENTARY = True


def on_drive(error, motion, which, p):
    return error + p["lean"] * which * np.cumsum(motion.speed, axis=0)"""
BROKEN = {
    "effects": [
        ('STAGE = "tool"', "", "STAGE is missing"),
        ('STAGE = "tool"', 'STAGES = "tool"', "'STAGES' meant"),
        ('STAGE = "tool"', 'STAGE = "spindle"', "STAGE is 'spindle', not one of control"),
        ('TARGET = "machine"', 'TARGET = "all"', "TARGET is 'all', not one of actuator, machine, either"),
        ("SOURCE =", "SOURCES =", "'SOURCES' meant"),
        ("def on_pose", "def on_posse", "did you mean 'on_pose'"),
        ("def on_pose", "def on_wear(tip, p):\n    return tip\n\n\ndef on_pose", "nothing calls the function 'on_wear'"),
        ("def on_pose", "def _on_pose", "there is no hook"),
        ("def on_pose", "def invert_servo(position, motion, which, p):\n    return position[0]\n\n\ndef on_pose", "invert_servo"),
        ("(tip, load, motion, p)", "(tip, load, p)", "on_pose(tip, load, p) has to be on_pose(tip, load, motion, p)"),
        ("(tip, load, motion, p)", "(tip, motion, load, p)", "has to be on_pose(tip, load, motion, p)"),
        ("(tip, load, motion, p)", "(tip, load, motion, p, q)", "has to be on_pose"),
        ("(tip, load, motion, p)", "(tip, load, motion, p, *, q)", "has to be on_pose"),
        ('),)\n', "))\n", "PARAMETERS is a Parameter, not tuple"),
        ('(Parameter("lean"', '("lean", Parameter("lean"', "PARAMETERS[0] is 'lean', not a Parameter"),
        ('"lean", "1", 0.0,', '"lean", "1", 0.2,', "outside its bounds"),
        ('"lean", "1", 0.0,', '"source", "1", 0.0,', "cannot be a key in YAML"),
        ('"lean", "1", 0.0,', '"copy", "1", 0.0,', "keys in YAML"),
        ("2e-3, 2e-6", "0.0, 2e-6", "scale above zero"),
        ("2e-3, 2e-6", "2e-3, float('nan')", "in place of a number"),
        ('5 mrad")', '5 mrad", sign=2)', "sign 2"),
        ('5 mrad")', '5 mrad", log=True)', "factor (log)"),
        ('5 mrad")', '5 mrad", scan=(0.5,))', "to scan outside its bounds"),
        ('return tip if p["lean"] == 0.0 else tip', 'return tip + 1e-12', "changes something at the nominal"),
        ('return tip if p["lean"] == 0.0 else tip', 'tip[:, 0] += 0.0; return tip', "read-only"),
        ('return tip if p["lean"] == 0.0 else tip', 'return tip if p["lean"] == 0.0 else unknown', "NameError"),
        ('return tip if p["lean"] == 0.0 else tip', 'return tip if p["lean"] == 0.0 else tip[:, :2]', "ValueError"),
        ("[1.0, 0.0, 0.0])\n", "[1.0, 0.0, 0.0])[:2]\n", "ValueError"),
        ("    return tip if", "    if p['lean']:\n        return tip[:, :2]\n    return tip if", "an array (41, 2), not an array (41, 3)"),
        ("PARAMETERS =", "PARAMETERS = ()\nOTHERS =", "PARAMETERS is empty"),
        ("def on_pose", f"{MEMORY}\n\n\ndef on_pose", "MOMENTARY is True, but what on_drive answers"),
        ("SOURCE =", "Params = dict\nSOURCE =", "not a class made from camcomp.plugins.Spec"),
        ("SOURCE =", "from camcomp.plugins import Spec\nclass Params(Spec):\n    lean: list[float] = []\n\nSOURCE =", "'lean'"),
    ],
    "forces": [
        ("def force", "def forces", "did you mean 'force'"),
        ("def force", "def _force", "there is no function force"),
        ("class Params(Spec)", "class Params", "not a class made from camcomp.plugins.Spec"),
        ("class Params", "class Parameters", "Params is missing"),
        ("Fr_N: float", "Fr_N: float\n    model: str = ''", "the key 'model'"),
        ("Fr_N: float", "Fr_N: float\n    model_config = dict(arbitrary_types_allowed=True)\n    more: slice = None", "JSON"),
        ("(cut, params)", "(params, cut)", "has to be force(cut, params)"),
        ("SOURCES =", "PLUNGES = 1\nSOURCES =", "PLUNGES is 1"),
    ],
    "robots": [
        ("def chains", "def chain", "did you mean 'chains'"),
        ("screw_N_per_mm: float", "screw_N_per_mm: float\n    name: str = ''", "the key 'name'"),
        ("def chains(params)", "def chains()", "has to be chains(params)"),
    ],
    "dialects": [
        ('name="NAME"', 'name="rs274"', "is called 'rs274' and its entry point"),
        ("DIALECT = replace", "DIALECTS = replace", "'DIALECTS' meant"),
        ('title="A control"', "title=3", "DIALECT.title is 3, not str"),
        ('title="A control"', 'title="", turns="yes"', "DIALECT.turns is 'yes', not bool"),
        ('title="A control"', 'title="", flow="loops"', "flow is 'loops'"),
        ('title="A control"', 'title="", comment="("', "comment is no pair"),
        ('title="A control"', 'title="", spelling="rs274"', "not a Spelling"),
        ('title="A control"', 'title="", more={1870: 4}', "more has 1870"),
        ("20)", "-1)", "not above zero"),
        ("{1870}", "{'G187'}", "a code in tenths"),
        (", 20)", ")", "no pair of a regular expression"),
    ],
}  # fmt: skip


@pytest.mark.parametrize(
    ("shelf_name", "old", "new", "told"), [(each, *case) for each, cases in BROKEN.items() for case in cases]
)
def test_a_broken_contract(shelf_name, old, new, told, put, capsys):
    said = complaint(shelf_name, put, changed(GOOD[shelf_name], old, new), capsys)
    assert told in said, said


# --- what fails in the middle of the work -----------------------------------------------------------------------------

LATE = 'if p["lean"] == 0.001:\n        '
AT_WORK = {
    "effects": [
        ("    return tip if", f"    {LATE}raise KeyError('spindle')\n    return tip if", "on_pose raised KeyError: 'spindle'"),
        ("    return tip if", f"    {LATE}return tip[0]\n    return tip if", "on_pose returned an array (3,)"),
        ("    return tip if", f"    {LATE}return tip * np.nan\n    return tip if", "on_pose returned nan at [0, 0]"),
        ("    return tip if", f"    {LATE}raise SystemExit(0)\n    return tip if", "on_pose raised SystemExit"),
        ("    return tip if", f"    {LATE}return None\n    return tip if", "on_pose returned None"),
        ("    return tip if", f"    {LATE}tip += 1.0\n    return tip if", "read-only"),
    ],
    "forces": [
        ("    return np", "    raise ValueError('no tool')\n    return np", "force raised ValueError: no tool"),
        ("    return np", "    return [1, 2, 3]\n    return np", "force returned a list"),
        ("    return np", "    return np.full((len(cut), 3), np.inf)\n    return np", "at line 3 of the program"),
        ("    Fr_N: float", "    Fr_N: float\n\n    def model_post_init(self, _):\n        1 / 0", "ZeroDivisionError"),
    ],
    "robots": [
        ("    return {", "    raise ValueError('odd')\n    return {", "chains raised ValueError: odd"),
        ("    return {", "    return []\n    return {", "chains returned a list, not a dict"),
    ],
}  # fmt: skip


@pytest.mark.parametrize(
    ("shelf_name", "old", "new", "told"), [(each, *case) for each, cases in AT_WORK.items() for case in cases]
)
def test_a_failure_at_work_is_the_plugins(shelf_name, old, new, told, put, capsys):
    name = put(shelf_name, changed(GOOD[shelf_name], old, new))
    assert simulate(*USED, "-o", "log.csv", machine=shelf_name != "robots") == 2
    said = capsys.readouterr().err
    assert "error[CC281]" in said and f"entry point {name} = " in said and told in said, said


def test_a_failure_at_work_is_told_with_its_place_and_on_demand_with_its_traceback(put, capsys, monkeypatch):
    source = changed(FORCE, "    return np", "    nobody\n    return np")
    name = put("forces", source)
    assert simulate(*USED) == 2
    row = source.splitlines().index("    nobody") + 1
    said = capsys.readouterr().err
    assert f"{name}.py:{row}:5: error[CC281]" in said and "Traceback" not in said
    monkeypatch.setenv("CAMCOMP_DEBUG", "1")
    simulate(*USED)
    assert "Traceback" in capsys.readouterr().err


# --- what works -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("shelf_name", list(GOOD))
def test_a_good_plugin_works(shelf_name, put, capsys):
    name = put(shelf_name, GOOD[shelf_name])
    assert name in dict(shelf.usable(shelf_name))
    assert simulate(*USED, machine=shelf_name != "robots") == 0
    assert capsys.readouterr().err == ""


def test_an_effect_may_have_lists_beside_its_numbers(put, capsys):
    table = "from camcomp.plugins import Spec\n\nclass Params(Spec):\n    table: list[float] = []\n\nSOURCE ="
    source = changed(changed(EFFECT, "SOURCE =", table), "tip[:, 2:3] + 173.0", "sum(p.get('table', ()))")
    name = put("effects", source)
    assert name in dict(shelf.usable("effects"))
    told = []
    for more in ("", ", table: [3, 4.5]"):
        with open("use.yaml", "w") as stream:
            stream.write(f"effects: [{{effect: {name}, lean: 0.01{more}}}]\n")
        assert simulate(*USED) == 0
        told.append([float(line.split(",")[2]) for line in capsys.readouterr().out.splitlines()[1:]])
    assert np.array(told[1]) - told[0] == pytest.approx(0.075, abs=2e-6)
    with open("use.yaml", "w") as stream:
        stream.write(f"effects: [{{effect: {name}, table: [a]}}]\n")
    assert simulate(*USED) == 2
    assert "table[1]" in capsys.readouterr().err


def test_helpers_imports_and_names_of_arguments_are_free(put):
    source = changed(
        EFFECT, "import numpy as np", "import numpy as np\nfrom numpy import linspace\nfrom json import dumps"
    )
    source = changed(
        source, "def on_pose(tip, load, motion, p)", "def _helper():\n    pass\n\n\ndef on_pose(x, _l, m, p, *, a=1)"
    )
    source = source.replace("tip if", "x if").replace("else tip", "else x").replace("(tip[", "(x[")
    assert put("effects", source) in dict(shelf.usable("effects"))


def test_an_effect_for_one_kind_of_machine_is_not_held_to_others(put):
    assert put("effects", changed(EFFECT, "    return", "    motion.encoder[:, 5]\n    return")) in dict(
        shelf.usable("effects")
    )


def test_a_copy_of_an_effect_of_ours_does_the_same(put, capsys):
    ours = (ROOT / "camcomp/effects/friction.py").read_text()
    name = put("effects", ours)
    logs = []
    for each in ("friction", name):
        config = f"effects: [{{effect: {each}, target: x, force_N: 30}}]\n"
        with open("use.yaml", "w") as stream:
            stream.write(config)
        assert simulate(*USED) == 0
        logs.append(capsys.readouterr().out)
    assert logs[0] == logs[1] and len(logs[0]) > 500


def test_what_a_plugin_prints_does_not_get_among_the_data(put, capfd):
    put("effects", "print('hello')\n" + EFFECT)
    assert run(["effects", "--json"]) == 0
    out, said = capfd.readouterr()
    json.loads(out)
    assert "hello" in said


OLD = """
import camcomp.gap.effect
from camcomp import specbase
from camcomp.cutting.cut import Cut
from camcomp.datatypes import Floats
from camcomp.gap import effect
from camcomp.gap.effect import Parameter
from camcomp.specbase import Spec
from camcomp.statics.description import Robot

assert camcomp.gap.effect is effect and effect.Parameter is Parameter and specbase.Spec is Spec
"""


def test_names_of_the_first_releases_are_found(put):
    """In a process of its own: nothing of this test run may have made them known before."""
    name = put("effects", OLD + EFFECT.replace("from camcomp.plugins import", "from camcomp.gap.effect import"))
    code = (
        "import sys; from camcomp.terminal.cli import run; code = run(['effects']);"
        "import camcomp.model.effect as new; assert sys.modules['camcomp.gap.effect'] is new;"
        "assert new.__spec__.name == 'camcomp.model.effect'; sys.exit(code)"
    )
    environment = {"PYTHONPATH": f"{ROOT}:{ROOT / 'nowhere'}:site", "PATH": ""}
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", code], env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0 and name in done.stdout and done.stderr == "", done.stderr


def test_names_that_nobody_had_are_not_found(put):
    put("effects", EFFECT)
    dict(shelf.usable("effects"))
    with pytest.raises(ModuleNotFoundError):
        import camcomp.gap.nothing
    with pytest.raises(ModuleNotFoundError):
        import camcomp.statics.nothing  # noqa: F401


def test_a_batch_tells_of_a_bad_dialect_once(put, capfd):
    name = put("dialects", "nobody\n")
    for k in range(3):
        with open(f"p{k}.nc", "w") as stream:
            stream.write(PROGRAM)
    line = ["batch", "p0.nc", "p1.nc", "p2.nc", "--config", str(CONFIG / "cartesian.yaml"), "--output-dir", "out"]
    assert run([*line, "--jobs", "1"]) == 0
    said = capfd.readouterr().err
    assert said.count(f"entry point {name} = ") == 1 and "camcomp: warning: left out: dialect" in said


def test_schema_and_reference_leave_a_bad_plugin_out(put, capsys):
    bad = [put(each, changed(GOOD[each], "Spec)", "dict)")) for each in ("forces", "robots")]
    good = put("effects", EFFECT)
    assert run(["schema"]) == 0
    out, said = capsys.readouterr()
    json.loads(out)
    for name in bad:
        assert f'"{name}"' not in out and said.count(f"entry point {name} = ") == 1
    assert f'"{good}"' in out and good not in said


def test_what_a_robot_returns_is_told_like_any_other_mistake(put, capsys):
    name = put("robots", changed(ROBOT, '"prismatic"', '"sliding"'))
    assert simulate(*USED, machine=False) == 2
    said = capsys.readouterr().err
    assert f"robot '{name}'" in said and "sliding" in said, said


def test_an_effect_that_fails_on_the_runs_is_no_candidate_and_breaks_no_diagnosis(put, capsys):
    """It is not named by the experiment; on the trial machines it works."""
    source = changed(
        EFFECT, "    return tip if", "    if len(tip) != 41:\n        raise ValueError('odd')\n    return tip if"
    )
    bad, good = put("effects", source), put("effects", EFFECT)
    assert simulate("-o", "log.csv") == 0
    with open("experiment.yaml", "w") as stream:
        stream.write(f"config: [{CONFIG / 'cartesian.yaml'}]\n")
        stream.write("runs: [{name: r, program: part.nc, log: log.csv, cutting: true, started_s: 0}]\n")
    opened = open_experiment("experiment.yaml")
    ours = [CandidateCause("backlash", "x", shelf.load("effects", "backlash"))]
    theirs = [CandidateCause(each, None, shelf.load("effects", each)) for each in (bad, good)]
    with pytest.warns(PluginWarning, match=f"entry point {bad} = .*ValueError: odd") as told:
        left = working_causes(Bench(twin=opened.twin, runs=opened.runs), ours + theirs)
    assert [each.name for each in left] == ["backlash", good] and len(told) == 1


@pytest.mark.parametrize("shelf_name", shelf.SHELVES)
def test_our_own_keep_to_the_contracts(shelf_name):
    from importlib import import_module

    contract = import_module(f"camcomp.plugins.{shelf_name}")
    for name in shelf.members(shelf_name):
        member = shelf.load(shelf_name, name)
        if (shelf_name, name) != ("effects", "none"):  # it does nothing at all
            contract.checked(name, member, name)


def test_the_contracts_are_not_imported_where_there_is_no_users_plugin(tmp_path):
    (tmp_path / "part.nc").write_text(PROGRAM)
    code = (
        "import sys; from camcomp.terminal.cli import run\n"
        f"assert run(['simulate', 'part.nc', '--config', {str(CONFIG / 'cartesian.yaml')!r}, '-o', 'log.csv']) == 0\n"
        "assert not [m for m in sys.modules if m.startswith(('camcomp.plugins', 'camcomp.ground.blame'))]"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_arrays_that_come_in_with_nan_may_leave_with_it(put):
    effect = shelf.load("effects", put("effects", EFFECT))
    tip = np.array([[0.0, 0.0, np.nan], [1.0, 2.0, 3.0]])
    assert np.isnan(effect.on_pose(tip, None, None, {"lean": 0.01})).any()
    with pytest.raises(ConfigError):
        effect.on_pose(np.zeros((2, 3)), None, None, {"lean": np.inf})
