"""Checked machine files that are kept for later runs."""

import subprocess
import sys
from pathlib import Path

import pytest

from camcomp.ground.files import shipped
from camcomp.model.config import kept, load
from camcomp.model.config.load import load_config
from camcomp.model.job import Job

MACHINE = shipped("config/orthoglide-1deg.yaml")
MACHINES = [path.name for path in sorted(Path(MACHINE).parent.glob("*.yaml")) if b"\nrobot:" in path.read_bytes()]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "cache"))
    return tmp_path


def files(folder):
    return list((folder / "cache").rglob("machine-*.nbc"))


def over(folder, text):
    (folder / "over.yaml").write_text(text)
    return [MACHINE, folder / "over.yaml"]


def contents(config):
    """Everything that a configuration holds, and where some of it was written."""
    force = config.process.force
    params = force.params and (type(force.params), vars(force.params))
    places = [config.at(), config.at("robot", "name"), config.at("tool"), config.at("process", "force", "model")]
    return (
        config.model_dump(),
        config.model_dump(exclude_unset=True),
        force.given,
        params,
        places,
        Job(config).fingerprint,
    )


@pytest.mark.parametrize("name", MACHINES)
def test_the_next_run_finds_the_same_configuration_without_reading_it(folder, monkeypatch, name):
    paths = [shipped(f"config/{name}")]
    first = contents(load_config(paths))
    assert len(files(folder)) == 1
    monkeypatch.setattr(load, "_checked_config", None)
    assert contents(load_config(paths)) == first


def test_files_of_other_bytes_or_order_are_read(folder):
    (folder / "a.yaml").write_text(Path(MACHINE).read_text())
    (folder / "b.yaml").write_text("compensation: {tolerance_um: 2}\n")
    (folder / "c.yaml").write_text("compensation: {tolerance_um: 3}\n")
    a, b, c = (str(folder / f"{name}.yaml") for name in "abc")
    found = [load_config(paths).compensation.tolerance_um for paths in ([a], [a, b], [a, c], [a, b, c], [a, c, b])]
    assert found == [1.0, 2.0, 3.0, 3.0, 2.0] and len(files(folder)) == 5
    (folder / "b.yaml").write_text("compensation: {tolerance_um: 4}\n")
    assert load_config([a, b]).compensation.tolerance_um == 4.0
    assert load_config([b, a]).at("robot").file == a


@pytest.mark.parametrize(
    "text",
    [
        "effects: [{effect: error_table, target: x, positions_mm: [-400, -300, 0], forward_um: [0, 5, 9]}]",
        "tool: {length_mm: {value: 100, sd: 0.01}}",
        "process: {force: {model: table, file: forces.csv}}",
        "tools: {file: tools.csv}",
    ],
    ids=["effects", "uncertain numbers", "force table", "tool table"],
)
def test_machine_files_that_depend_on_more_than_their_text_are_not_kept(folder, text):
    (folder / "forces.csv").write_text("t_s,fx_N,fy_N,fz_N\n0,1,2,3\n1,1,2,3\n")
    (folder / "tools.csv").write_text("number,diameter_mm\n1,5\n")
    config = load_config(over(folder, text))
    assert not files(folder)
    assert config.effects or config.spreads or config.tools or config.process.force.params.file


def test_plugins_of_the_user_are_checked_in_every_run(folder, monkeypatch):
    own = type("Params", (load.Spec,), {"__module__": "plugin_of_a_user"})
    monkeypatch.setattr("camcomp.forces.none.Params", own)
    load_config(over(folder, "process: {force: {model: none}}"))
    assert not files(folder)


def test_a_configuration_of_another_state_of_the_sources_is_not_used(folder, monkeypatch):
    load_config([MACHINE])
    monkeypatch.setattr(kept, "_state", lambda: "another")
    texts, _ = load._read_texts([MACHINE])
    assert kept.KeptConfig(texts).load() is None


def test_a_damaged_file_counts_as_none(folder):
    load_config([MACHINE])
    (file,) = files(folder)
    data = bytearray(file.read_bytes())
    data[-9] ^= 1
    file.write_bytes(data)
    assert load_config([MACHINE]).robot.name


def test_files_with_errors_are_not_kept(folder):
    with pytest.raises(load.ConfigError):
        load_config(over(folder, "compensation: {tolerance_um: none}"))
    with pytest.raises(load.FileError):
        load_config([MACHINE, folder / "missing.yaml"])
    assert not files(folder)


def test_the_place_of_a_kept_value_is_read_from_the_text_that_was_loaded(folder):
    paths = over(folder, "compensation:\n  tolerance_um: 2\n")
    load_config(paths)
    config = load_config(paths)
    over(folder, "")
    assert config.at("compensation", "tolerance_um").line == 2


def test_a_start_with_a_kept_file_imports_no_yaml_parser(folder):
    code = f"""
import sys
from camcomp.api.machine import load_machine
job = load_machine({str(MACHINE)!r})
job.machine, job.fingerprint
assert ("ruamel.yaml" in sys.modules) is {{first}}, sorted(sys.modules)
assert ("importlib.metadata" in sys.modules) is {{first}}
"""
    for first in (True, False):
        subprocess.run([sys.executable, "-c", code.format(first=first)], check=True)
