"""Files and names of strangers: contents stay unseen, control characters are shown as escapes, nothing ends as a bug."""

import json
import os
import subprocess
import sys
import zipfile
from xml.etree import ElementTree

import numpy as np
import pytest

from camcomp.ground.errors import Location, ProgramError, format_error
from camcomp.ground.files import shipped
from camcomp.terminal.cli import run
from tests.commandline import ROOT

PROGRAM = "G21 G90 G94\nG0 X0 Y0 Z5\nG1 Z0 F100\nX4\nM30\n"
SECRETS = {
    "passwd": "root:s3cret:0:0:root:/root:/bin/bash\nme:s3cret:1000:1000::/home/me:/bin/sh\n",
    "key": "-----BEGIN OPENSSH PRIVATE KEY-----\ns3cretAAAAB3NzaC1yc2EAAA\n-----END OPENSSH PRIVATE KEY-----\n",
    "env": "PASSWORD=s3cret\n",
    "env lines": "PASSWORD=s3cret\nTOKEN=s3cret\n",
    "semicolons": "user;password\nme;s3cret\n",
    "commas": "user,password\nme,s3cret\nyou,s3cret\n",
    "yaml": "password: s3cret\ntokens: [s3cret]\n",
    "bytes": "\x80\xff s3cret\n",
}


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.nc").write_text(PROGRAM)
    return tmp_path


def config():
    return str(shipped("config/cartesian.yaml"))


def everything(folder, capsys):
    out, err = capsys.readouterr()
    made = [
        each.read_text(errors="replace") for each in folder.rglob("*") if each.is_file() and "made" in each.parts[-2:]
    ]
    return "\n".join([out, err, *made])


@pytest.mark.parametrize("kind", SECRETS)
@pytest.mark.parametrize(
    "way", ["batch", "program", "log", "force", "error table", "comp", "mirror", "compare", "import", "stl"]
)
def test_no_file_is_read_aloud(folder, capsys, kind, way):
    secret = folder / "secret"
    secret.write_bytes(SECRETS[kind].encode("latin-1"))
    (folder / "made").mkdir()
    words = {
        "program": ["validate", "secret"],
        "mirror": ["compensate", "a.nc", "--config", config(), "--mirror", "secret", "-o", "made/o.nc"],
        "compare": ["compare", "secret", "secret"],
        "import": ["import", "secret", "--config", config(), "-o", "made"],
    }.get(way, ["compensate", "a.nc", "--config", config(), "--config", "more.yaml", "-o", "made/o.nc"])
    if way == "batch":
        (folder / "in").mkdir()
        (folder / "in/x.nc").symlink_to(secret)
        words = [
            "batch",
            "in",
            "--config",
            config(),
            "--output-dir",
            "made",
            "--jobs",
            "1",
            "--sarif",
            "made/s",
            "--junit",
            "made/j",
        ]
    elif way == "log":
        (folder / "e.yaml").write_text(
            f"config: [{config()}]\nruns: [{{name: r, program: a.nc, log: secret, cutting: false}}]\n"
        )
        words = ["validate", "e.yaml"]
    (folder / "more.yaml").write_text(
        {
            "force": "process: {force: {model: table, file: secret}}\n",
            "error table": "effects: [{effect: axis_error, target: EXX, file: secret}]\n",
            "comp": "effects: [{effect: screw_pitch, target: x, file: secret, comp_type: 0}]\n",
            "stl": "workpiece: {stock: {type: stl, file: secret}}\ntool: {diameter_mm: 4}\n",
        }.get(way, "tool: {diameter_mm: 4}\n")
    )
    assert run(words) not in (0, 1, 70)
    assert "s3cret" not in everything(folder, capsys)


def test_control_characters_are_shown_as_escapes():
    name, source = "\x1b[31mred\udcff\u202e.nc", "\tG1 \x1b[2J\x9bX"
    text = format_error(ProgramError("CC107", "sign '\x07'", at=Location(name, 1, 5, source), hint="\x1b]0;title\x07"))
    assert not any(ord(sign) < 32 and sign not in "\n\t" or 127 <= ord(sign) < 160 for sign in text)
    assert "\\x1b[31mred\\xff\\u202e.nc:1:5" in text and "\tG1 \\x1b[2J\\x9bX" in text and "sign '\\x07'" in text
    text.encode()


def test_a_line_break_in_a_name_makes_no_line_of_its_own(folder, capsys):
    name = "new\nok.nc"
    (folder / name).write_text(PROGRAM)
    run(["validate", name])
    run(["batch", name, "--config", config(), "--output-dir", "out", "--jobs", "1"])
    said = capsys.readouterr()
    assert "new\\nok.nc" in said.out + said.err and "new\nok.nc" not in said.out + said.err


def test_validate_refuses_a_log_that_measures_nothing(folder, capsys):
    (folder / "log.csv").write_text("t_s,x actual [mm]\n0,1\n1,2\n")
    runs = [{"name": "a", "log": "log.csv", "cutting": False}]
    (folder / "e.yaml").write_text(json.dumps({"config": [config()], "runs": runs}))
    assert run(["validate", "e.yaml"]) == 2
    assert "CC404" in (said := capsys.readouterr().err) and "camcomp import" in said
    twice = [f"{t},{0.1 * t + lap}" for lap in (0, 1) for t in range(9)]
    (folder / "log.csv").write_text("\n".join(["t_s,act_x_mm", *twice, ""]))
    assert run(["validate", "e.yaml"]) == 2
    assert "CC405" in capsys.readouterr().err


def test_a_strange_number_of_threads_is_no_bug(folder, monkeypatch, capsys):
    monkeypatch.setenv("OPENBLAS_NUM_THREADS", "all")
    (folder / "e.yaml").write_text(json.dumps({"config": [config()], "runs": []}))
    assert run(["diagnose", "e.yaml"]) == 2


NOT_UTF8 = os.fsdecode(b"b\xff\x1b[31m.nc")


@pytest.fixture
def odd(folder):
    try:
        (folder / NOT_UTF8).write_text(PROGRAM)
    except OSError:
        pytest.skip("this disk has no such names")
    return folder


def test_names_that_are_not_utf8_lose_no_program_of_a_batch(odd, capsys):
    words = [
        "batch",
        ".",
        "--config",
        config(),
        "--output-dir",
        "out",
        "--jobs",
        "1",
        "--sarif",
        "s.sarif",
        "--junit",
        "j.xml",
    ]
    assert run(words) == 0
    assert {each.name for each in (odd / "out").glob("*.nc")} == {"a.nc", NOT_UTF8}
    assert json.loads((odd / "out/camcomp-batch.json").read_text())["counts"]["done"] == 2
    ElementTree.parse(odd / "j.xml")
    assert "\x1b" not in capsys.readouterr().err
    assert run(words) == 0 and "2 unchanged" in capsys.readouterr().err


def test_names_that_are_not_utf8_are_no_bug_of_any_verb(odd, capsys):
    (odd / NOT_UTF8).write_text("G21 G90\nG1 X1 F100\nQ\n")
    assert run(["validate", NOT_UTF8, "--sarif", "s.sarif", "--json", "v.json", "--junit", "j.xml"]) == 3
    (result,) = json.loads((odd / "s.sarif").read_text(encoding="utf-8"))["runs"][0]["results"]
    assert result["locations"][0]["physicalLocation"]["artifactLocation"]["uri"] == "b%FF%1B%5B31m.nc"
    json.loads((odd / "v.json").read_text(encoding="utf-8"))
    (odd / NOT_UTF8).write_text("t_s,cmd_x_mm,act_x_mm\n" + "".join(f"{i},{i},{i}\n" for i in range(20)))
    assert run(["import", NOT_UTF8, "--config", config(), "-o", "d"]) == 2
    assert "CC424" in capsys.readouterr().err


def test_links_that_lead_round_in_a_circle(folder, capsys):
    (folder / "one.nc").symlink_to("two.nc")
    (folder / "two.nc").symlink_to("one.nc")
    assert run(["compensate", "one.nc", "--config", config()]) == 5
    assert run(["compensate", "a.nc", "--config", "one.nc"]) == 5
    assert run(["compensate", "a.nc", "--config", config(), "-o", "one.nc", "-q"]) == 5
    assert (folder / "one.nc").is_symlink() and "CC501" in capsys.readouterr().err
    assert run(["batch", ".", "--config", config(), "--output-dir", "out", "--jobs", "1"]) == 5
    assert (folder / "out/a.nc").exists()


def test_a_name_that_ends_as_a_folder_is_no_output(folder, capsys):
    assert run(["compensate", "a.nc", "--config", config(), "-o", "x/", "-q"]) == 5
    assert "CC501" in capsys.readouterr().err and not (folder / "x").exists()


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="a device of Linux")
@pytest.mark.parametrize(
    ("words", "code"), [(["explain", "CC999"], 2), (["nothing"], 2), (["validate", "not-there.nc"], 5)]
)
def test_messages_that_cannot_be_written_change_no_exit_code(folder, words, code):
    with open("/dev/full", "wb") as full:
        done = subprocess.run(
            [sys.executable, "-m", "camcomp", *words],
            stderr=full,
            env={**os.environ, "PYTHONPATH": str(ROOT), "PYTHONUNBUFFERED": ""},  # it hides errors of the last flush
            check=False,
        )
    assert done.returncode == code


@pytest.mark.parametrize("way", ["variable", "file of the folder"])
def test_settings_with_which_numba_does_not_start(folder, way):
    words = ["compensate", "a.nc", "--config", config(), "-q"]
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "NUMBA_CACHE_DIR": str(folder / "nothing compiled yet")}
    if way == "variable":
        environment["NUMBA_NUM_THREADS"] = "0"
    else:
        pytest.importorskip("yaml")
        (folder / ".numba_config.yaml").write_text("s3cret: [\n")
    done = subprocess.run(
        [sys.executable, "-m", "camcomp", *words], env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 2 and "numba does not start" in done.stderr and "s3cret" not in done.stderr


@pytest.mark.parametrize("far", ["XFD1048576", pytest.param("A1048576", marks=pytest.mark.campaign), "XFD3"])
def test_a_small_workbook_with_a_far_cell_takes_little_memory(folder, far):
    openpyxl = pytest.importorskip("openpyxl")
    from camcomp.diagnosis.recordings.xlsx_file import read_xlsx

    book = openpyxl.Workbook()
    for row in (["t_s", "act_x_mm"], [0, 1], [1, 2]):
        book.active.append(row)
    book.save("small.xlsx")
    number = far.lstrip("XFDA")
    row = "" if number == "3" else f'<row r="{number}"><c r="{far}"><v>1</v></c></row>'
    with zipfile.ZipFile("small.xlsx") as old, zipfile.ZipFile("far.xlsx", "w", zipfile.ZIP_DEFLATED) as new:
        for name in old.namelist():
            data = old.read(name)
            if name == "xl/worksheets/sheet1.xml":
                data = data.replace(b"</sheetData>", row.encode() + b"</sheetData>")
                data = data.replace(b'ref="A1:B3"', f'ref="A1:{far}"'.encode())
            new.writestr(name, data)
    (part,) = read_xlsx((folder / "far.xlsx").read_bytes(), "far.xlsx")
    assert part.names == ("t_s", "act_x_mm") and np.array_equal(part.read(0)[:2], [0.0, 1.0])


def test_a_workbook_of_more_than_any_log_is_refused(folder, monkeypatch):
    openpyxl = pytest.importorskip("openpyxl")
    from camcomp.diagnosis.recordings import xlsx_file
    from camcomp.ground.errors import ConfigError

    book = openpyxl.Workbook()
    for _ in range(30):
        book.active.append(list(range(10)))
    book.save("large.xlsx")
    for name, most in (("MOST_CELLS", 299), ("MOST_ROWS", 28), ("MOST_TABLE_BYTES", 1000)):
        with monkeypatch.context() as patched:
            patched.setattr(xlsx_file, name, most)
            with pytest.raises(ConfigError, match="more than") as refused:
                xlsx_file.read_xlsx((folder / "large.xlsx").read_bytes(), "large.xlsx")
        assert refused.value.rule == "CC425"


def test_texts_that_spreadsheets_compute_are_texts():
    from camcomp.api.result_table import ResultTable

    runs = ["=cmd|' /C calc'!A0", "+1+cmd", "-2+3", "@SUM(A1)", "-1.5", "run"]
    text = ResultTable({"run": np.array(runs), "t_s": np.arange(6.0)}).to_csv().decode()
    firsts = [line[0] if line[0] != '"' else line[1] for line in text.splitlines()[1:]]
    assert firsts == ["'", "'", "'", "'", "-", "r"]
