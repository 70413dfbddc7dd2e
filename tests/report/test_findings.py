"""SARIF, JUnit and JSON of validate, verify and batch, as a code host and a CI server require them."""

import json
from xml.etree import ElementTree as xml

import pytest

from camcomp.ground.rules import RULES
from camcomp.report.findings import Case, Finding, relative
from camcomp.report.junit import junit
from camcomp.report.sarif import sarif
from camcomp.terminal.cli import run
from tests.commandline import ROOT

CARTESIAN = str(ROOT / "config/cartesian.yaml")
GOOD = "G21 G90 G17 G94\nS8000 M3\nG0 X0 Y0 Z5\nG1 X10 F600\nM30\n"
BAD = "G21 G90 G17 G94\nS8000 M3\nG0 X0 Y0 Z5\nG1 X1,5 F600\nM30\n"


@pytest.fixture
def shop(tmp_path, monkeypatch):
    """A folder of programs: a good one, and one with a decimal comma in a folder with a blank in its name."""
    (tmp_path / "part 1").mkdir()
    (tmp_path / "good.nc").write_text(GOOD)
    (tmp_path / "part 1/bad.nc").write_text(BAD)
    (tmp_path / "bad.yaml").write_text("robot:\n  nmae: x\ntoool: 1\n")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_sarif_of_validate(shop):
    assert run(["validate", "good.nc", "part 1/bad.nc", "bad.yaml", "--sarif", "v.sarif"]) in (2, 3)
    log = json.loads((shop / "v.sarif").read_text())
    assert log["version"] == "2.1.0" and log["$schema"].endswith("sarif-2.1.0.json")
    (one,) = log["runs"]
    rules = one["tool"]["driver"]["rules"]
    assert [rule["id"] for rule in rules] == sorted({each["ruleId"] for each in one["results"]})
    assert {rule["id"] for rule in rules} <= set(RULES)
    assert len(one["results"]) >= 3
    for result in one["results"]:
        assert rules[result["ruleIndex"]]["id"] == result["ruleId"]
        assert result["level"] == "error" and result["message"]["text"]
    (comma,) = [each for each in one["results"] if each["ruleId"] == "CC101"]
    place = comma["locations"][0]["physicalLocation"]
    assert place["artifactLocation"] == {"uri": "part%201/bad.nc", "uriBaseId": "%SRCROOT%"}
    assert place["region"]["startLine"] == 4 and place["region"]["startColumn"] == 4
    assert place["region"]["snippet"]["text"] == "G1 X1,5 F600"
    prints = [each["partialFingerprints"]["camcomp/v1"] for each in one["results"]]
    assert len(set(prints)) == len(prints)


def test_fingerprints_stay_when_lines_are_put_in_above():
    def prints(*findings):
        log = json.loads(sarif([Case("p.nc", findings)]))
        return [each["partialFingerprints"]["camcomp/v1"] for each in log["runs"][0]["results"]]

    at = [Finding(rule="CC101", message="m", file="p.nc", line=line, column=3, source="G1 X1,5") for line in (4, 9)]
    moved = [Finding(rule="CC101", message="m", file="p.nc", line=line, column=3, source="G1 X1,5") for line in (5, 10)]
    assert prints(*at) == prints(*moved)
    assert len(set(prints(*at))) == 2
    assert prints(Finding(rule="CC101", message="m", file="q.nc", line=4, column=3, source="G1 X1,5")) != prints(at[0])


def test_standard_input_has_no_place_and_a_file_may_have_no_line():
    log = json.loads(
        sarif(
            [
                Case("-", [Finding(rule="CC101", message="m", file="<stdin>", line=1, column=1)]),
                Case("a", [Finding(rule="CC500", message="m", file="a")]),
            ]
        )
    )
    first, second = log["runs"][0]["results"]
    assert "locations" not in first
    assert second["locations"] == [{"physicalLocation": {"artifactLocation": {"uri": "a", "uriBaseId": "%SRCROOT%"}}}]


def test_paths_are_seen_from_the_working_folder(shop):
    assert relative(str(shop / "part 1" / "bad.nc")) == "part 1/bad.nc"


def test_junit_of_validate(shop):
    assert run(["validate", "good.nc", "part 1/bad.nc", "no-such.nc", "--junit", "v.xml"]) in (3, 5)
    root = xml.parse(shop / "v.xml").getroot()
    assert root.tag == "testsuites"
    suite = root[0]
    assert {k: suite.get(k) for k in ("tests", "failures", "errors", "skipped")} == {
        "tests": "3", "failures": "0", "errors": "2", "skipped": "0",
    }  # fmt: skip
    good, bad, missing = suite
    assert good.get("name") == "good.nc" and [each.tag for each in good] == ["system-out"]
    assert bad[0].tag == "error" and bad[0].get("type") == "CC101"
    assert bad[0].text.startswith("part 1/bad.nc:4:4: error[CC101]: ")
    assert missing[0].get("type") == "CC500"


def test_junit_holds_every_text():
    case = Case("a\x01.nc", [Finding(rule="CC601", message="0 < 1 & \x00 \ud800 ]]> ä", file="a", check=True)])
    root = xml.fromstring(junit("s", [case]))
    assert root[0].get("failures") == "1" and root[0].get("errors") == "0"
    assert "0 < 1 & \ufffd \ufffd ]]> ä" in root[0][0][0].get("message")


def test_json_of_validate_goes_to_standard_output_alone(shop, capsys):
    assert run(["validate", "good.nc", "part 1/bad.nc", "--json", "-"]) == 3
    told = json.loads(capsys.readouterr().out)
    assert told["ok"] is False and [each["ok"] for each in told["files"]] == [True, False]
    assert told["files"][1]["findings"][0]["rule"] == "CC101"
    assert told["files"][1]["findings"][0]["line"] == 4


def test_quiet_validate_says_nothing_about_sound_files(shop, capsys):
    assert run(["validate", "--quiet", "good.nc"]) == 0
    assert capsys.readouterr() == ("", "")
    assert run(["validate", "-q", "part 1/bad.nc"]) == 3
    out, err = capsys.readouterr()
    assert out == "" and "part 1/bad.nc:4:4: error[CC101]" in err


def test_verify_points_at_the_lines_of_the_original(shop):
    words = [
        "verify",
        "good.nc",
        "--against",
        "good.nc",
        "--config",
        CARTESIAN,
        "--sarif",
        "v.sarif",
        "--junit",
        "v.xml",
    ]
    assert run(words) == 1
    (result,) = json.loads((shop / "v.sarif").read_text())["runs"][0]["results"]
    assert result["ruleId"] == "CC601" and "um are left" in result["message"]["text"]
    place = result["locations"][0]["physicalLocation"]
    assert place["artifactLocation"]["uri"] == "good.nc" and place["region"]["startLine"] == 4
    suite = xml.parse(shop / "v.xml").getroot()[0]
    assert (suite.get("failures"), suite.get("errors")) == ("1", "0")


def test_verify_of_an_unreadable_program_is_an_error(shop):
    words = ["verify", "part 1/bad.nc", "--against", "good.nc", "--config", CARTESIAN, "--junit", "v.xml"]
    assert run(words) == 3
    assert xml.parse(shop / "v.xml").getroot()[0].get("errors") == "1"


def test_batch_has_a_case_per_program(shop):
    words = ["batch", ".", "--config", CARTESIAN, "--output-dir", "out", "--jobs", "1", "--quiet"]
    assert run([*words, "--sarif", "b.sarif", "--junit", "b.xml"]) == 3
    suite = xml.parse(shop / "b.xml").getroot()[0]
    assert [case.get("name") for case in suite] == ["good.nc", "part 1/bad.nc"]
    assert [[each.tag for each in case] for case in suite] == [["system-out"], ["error", "system-out"]]
    (result,) = json.loads((shop / "b.sarif").read_text())["runs"][0]["results"]
    assert result["ruleId"] == "CC101"
    assert result["locations"][0]["physicalLocation"]["artifactLocation"]["uri"] == "part%201/bad.nc"


def test_equal_runs_give_equal_files(shop):
    for name in ("a", "b"):
        run(["validate", "part 1/bad.nc", "--sarif", f"{name}.sarif", "--junit", f"{name}.xml"])
    for kind in ("sarif", "xml"):
        assert (shop / f"a.{kind}").read_bytes() == (shop / f"b.{kind}").read_bytes()
