"""The compensation report as a file: what stands in it, and what must not."""

import base64
import json
import re
import sys
from hashlib import sha256
from html import unescape

import numpy as np
import pytest

from camcomp.report import page as page_module
from camcomp.terminal.cli import run
from tests.commandline import ROOT, table

PROGRAM = ROOT / "samples/groove-circle-2.nc"
CONFIG = ROOT / "config/orthoglide-1deg.yaml"


def text_of(html):
    """Words of the page, without scripts and styles."""
    body = re.sub(r"<(script|style)[ >].*?</\1>", " ", html, flags=re.DOTALL)
    return unescape(re.sub(r"<[^>]*>", " ", body)).replace("\u00a0", " ")


def figures_of(html):
    data = re.search(r'<script type="application/json" id="figures">(.*?)</script>', html, re.DOTALL)[1]
    return {each["name"]: each for each in json.loads(data)}


def compensate(folder, *more, program=PROGRAM, config=CONFIG, code=0):
    out = folder / "r.html"
    words = ["compensate", program, "--config", config, "-o", folder / "out.nc", "--report", out, *more]
    assert run([str(each) for each in words]) == code
    return out.read_text(encoding="utf-8") if code == 0 else ""


def test_equal_inputs_give_equal_bytes_wherever_they_lie(report, tmp_path, monkeypatch):
    (tmp_path / "elsewhere").mkdir()
    program, config = tmp_path / "elsewhere" / PROGRAM.name, tmp_path / CONFIG.name
    program.write_bytes(PROGRAM.read_bytes())
    config.write_bytes(CONFIG.read_bytes())
    monkeypatch.chdir(tmp_path)
    again = compensate(tmp_path, program=f"elsewhere/{PROGRAM.name}", config=config)
    assert again == report.read_text(encoding="utf-8")
    assert str(tmp_path) not in again


def test_figures_agree_with_the_tables(report, tmp_path):
    joints, summary = tmp_path / "j.csv", tmp_path / "s.json"
    words = ["compensate", PROGRAM, "--config", CONFIG, "--joints", joints, "--summary", summary]
    assert run([str(each) for each in words]) == 0
    columns, figures = table(joints), figures_of(report.read_text(encoding="utf-8"))
    drive = figures["drive-slides"]["traces"]
    for trace, name in zip(drive, "xyz", strict=True):
        drawn = np.array(trace["y"], float)
        assert trace["name"] == name
        assert np.nanmax(np.abs(drawn)) == pytest.approx(np.abs(columns[f"act_{name}_N"]).max(), rel=1e-4)
    for trace, axis in zip(figures["shift"]["traces"], "xyz", strict=True):
        drawn = {round(v, 1) for v in trace["y"] if v is not None}
        assert drawn <= {round(1e3 * v, 1) for v in columns[f"{axis}c_mm"] - columns[f"{axis}_mm"]}
    worst = np.nanmax(np.array(figures["error"]["traces"][0]["y"], float))
    before = json.loads(summary.read_text())["before"]["max_um"]
    assert worst == pytest.approx(before, rel=0.02)
    assert f"{before:.0f} µm" in text_of(report.read_text(encoding="utf-8"))


def test_rapids_are_gaps(tmp_path):
    program = tmp_path / "p.nc"
    program.write_text("G21 G90 G17 G94\nS8000 M3\nG0 X0 Y0 Z5\nG1 X10 F600\nG0 Y5\nX20\nG1 X30\nM30\n")
    figures = figures_of(compensate(tmp_path, program=program, config=ROOT / "config/cartesian.yaml"))
    along = figures["shift"]["traces"][0]["x"]
    base = figures["trajectories"]["exaggerate"]["base"]
    assert strokes(along) == [(5.0, 15.0), (30.0, 40.0)]
    assert strokes(base["x"]) == [(0.0, 10.0), (20.0, 30.0)]


def strokes(values):
    """Start and end of every unbroken part of a curve that has a length."""
    parts = [[]]
    for value in values:
        parts.append([]) if value is None else parts[-1].append(value)
    return [(part[0], part[-1]) for part in parts if part and part[0] != part[-1]]


def test_every_file_stands_there_with_its_fingerprint(report):
    words = text_of(report.read_text(encoding="utf-8"))
    for path in (PROGRAM, CONFIG, report.parent / "out.nc"):
        assert sha256(path.read_bytes()).hexdigest() in words
    assert "orthoglide-1deg.yaml:17" in words and "[1, 0, 0]" in words


def test_names_and_comments_cannot_become_markup(tmp_path):
    config = tmp_path / "m.yaml"
    evil = "</script><script>alert(1)</script><b>"
    text = CONFIG.read_text().replace("Orthoglide, chains turned by 1 degree", f'"{evil}"')
    config.write_text(text)
    html = compensate(tmp_path, config=config)
    assert "alert(1)</script>" not in html and "&lt;/script&gt;&lt;script&gt;alert(1)" in html


def test_a_failed_check_is_the_verdict(tmp_path):
    config = tmp_path / "m.yaml"
    config.write_text(CONFIG.read_text().replace("home_mm: -300,", "home_mm: -300, limits_mm: [-1, 1],"))
    compensate(tmp_path, config=config, code=1)
    html = (tmp_path / "r.html").read_text(encoding="utf-8")
    assert 'class="verdict bad"' in html and "actuator x leaves its travel" in text_of(html)


def test_without_the_plot_library_a_clear_refusal(tmp_path, monkeypatch, capsys):
    page_module.plot_library.cache_clear()
    monkeypatch.setitem(sys.modules, "plotly.offline", None)
    compensate(tmp_path, code=2)
    assert "pip install 'camcomp[report]'" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_a_report_alone_writes_no_program_to_the_terminal(tmp_path, capsysbinary):
    words = ["compensate", str(PROGRAM), "--config", str(CONFIG), "--report"]
    assert run([*words, str(tmp_path / "r.html")]) == 0
    assert capsysbinary.readouterr().out == b""
    assert run([*words, "-"]) == 0
    assert capsysbinary.readouterr().out == (tmp_path / "r.html").read_bytes()


def test_no_clock_goes_into_the_packed_library():
    assert base64.b64decode(page_module.plot_library())[4:8] == bytes(4)


def test_bands_and_trust_are_drawn(tmp_path):
    spread = tmp_path / "spread.yaml"
    spread.write_text("process: {force: {Fr_N: {sd: 60}}}\ncompensation: {policy: shrink}\n")
    joints = tmp_path / "j.csv"
    html = compensate(tmp_path, "--config", spread, "--joints", joints, "-q")
    words, figures, columns = text_of(html), figures_of(html), table(joints)
    assert "Machines drawn from them leave" in words and "100 % of this spread comes from the cutting force" in words
    assert re.search(r"process\.force\.Fr_N\s+100\.0", words)
    upper = next(each for each in figures["band"]["traces"] if each["name"].startswith("corrected, 95 %"))
    drawn = np.array(upper["y"], float)
    assert np.nanmax(drawn) == pytest.approx(np.nanmax(columns["band_um"]), rel=0.01)
    area = figures["band"]["traces"][0]
    for name in ("band", "error"):
        assert any(each["name"].startswith("corrected, as the control drives it") for each in figures[name]["traces"])
    assert area["fill"] == "toself" and max(y for y in area["y"] if y is not None) == pytest.approx(np.nanmax(drawn))
    kinds = {each["name"] for each in figures["trust"]["traces"]}
    assert "trusted" in kinds and kinds <= {"trusted", "doubtful", "shrunk", "left alone"}


def test_what_a_policy_leaves_is_no_riddle_beside_the_tolerance(tmp_path):
    spread = tmp_path / "spread.yaml"
    spread.write_text("process: {force: {Fr_N: {sd: 150}}}\ncompensation: {policy: shrink}\n")
    words = text_of(compensate(tmp_path, "--config", spread, "--summary", tmp_path / "s.json", "-q"))
    taken = json.loads((tmp_path / "s.json").read_text())["taken"]
    less = taken["shrunk"] + taken["left_alone"]
    assert less > 0
    assert f"on purpose: with the policy shrink {less} of {taken['points']} points take less than the whole" in words
    spread.write_text("process: {force: {Fr_N: {sd: 150}}}\n")
    assert "on purpose" not in text_of(compensate(tmp_path, "--config", spread, "-q"))
