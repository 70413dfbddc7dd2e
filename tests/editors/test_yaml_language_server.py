"""Hover, completion and findings of yaml-language-server on machine files and experiment files."""

import pytest

from camcomp.ground import shelf
from tests.commandline import ROOT
from tests.editors.language_server import LanguageServer, binary

pytestmark = pytest.mark.ecosystem
SERIAL = {"convention", "chain", "base", "flange", "joints"}


@pytest.fixture(scope="module")
def server_path(tmp_path_factory):
    return binary(tmp_path_factory.mktemp("npm"))


@pytest.fixture(params=["machine"])
def server(request, server_path):
    name = {"machine": "camcomp.schema.json", "experiment": "camcomp-experiment.schema.json"}[request.param]
    made = LanguageServer(server_path, ROOT / "config" / name)
    made.findings(made.open("\n"))  # from then on the schema is there
    yield made
    made.close()


def offered(server, text):
    """Completions at the end of a text."""
    lines = text.split("\n")
    return server.offered(server.open(text + "\n"), len(lines) - 1, len(lines[-1]))


def test_hover_says_meaning_unit_default_and_example(server):
    uri = server.open("control:\n  resolution_mm: 0.001\n")
    server.findings(uri)
    text = server.hover(uri, 1, 5)
    assert "smallest step of a number" in text and "Unit: mm. Default: 0.001. Example: 0.0001" in text


def test_a_serial_machine_is_offered_serial_keys_only(server):
    found = offered(server, "robot:\n  name: arm\n  type: serial\n  ")
    assert found >= SERIAL and "chains" not in found
    found = offered(server, "robot:\n  name: gantry\n  chains: {}\n  ")
    assert not found & SERIAL


def test_names_and_keys_of_plug_ins_are_offered(server):
    assert offered(server, "process:\n  force:\n    model: ") == set(shelf.members("forces"))
    found = offered(server, "effects:\n  - effect: backlash\n    ")
    assert found >= {"target", "width_mm", "width_rad"} and "force_N" not in found
    assert offered(server, "tools:\n  ") >= {"file", "unit"}


def test_mistakes_are_found_and_shipped_files_have_none(server):
    found = server.findings(server.open("control:\n  resolutoin_mm: 0.001\n  start_mm: 3\n"))
    assert any("resolutoin_mm" in each for each in found) and len(found) == 2
    found = server.findings(server.open("robot:\n  name: arm\n  type: serial\n  chains: {}\n"))
    assert any("chains" in each for each in found)
    for path in sorted((ROOT / "config").glob("*.yaml")):
        assert server.findings(server.open(path.read_text(encoding="utf-8"), path)) == [], path.name


@pytest.mark.parametrize("server", ["experiment"], indirect=True)
def test_experiment_files_are_known_too(server):
    assert offered(server, "runs:\n  - name: a\n    ") >= {"program", "log", "cutting", "started_s", "clamping"}
    uri = server.open("sd:\n  tip_mm: 0.003\n")
    server.findings(uri)
    assert "Unit: mm" in server.hover(uri, 1, 3)
