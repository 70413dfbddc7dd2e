"""How much of a correction is taken, in whole programs and long ones, and what verify reads of it from the text."""

import json

import numpy as np
import pytest

from camcomp.compensation import file_to_file
from camcomp.ground.files import shipped
from camcomp.terminal.cli import run
from tests import schemas
from tests.benchmarks.programs import write
from tests.commandline import table

BASE = shipped("config/orthoglide-1deg.yaml")
SPREAD = "process: {force: {Fr_N: {sd: 90, group: cut}, Ft_N: {sd: 2, group: cut}, Fz_N: {sd: 4}}}\n"
PROGRAM = """G21 G90 G17 G94
S8000 M3
G0 X12 Y0 Z5
G1 Z0 F300
G3 X12 Y0 I-12 J0 F600
G1 X5 Y10
G1 X-10
G1 Y-14
G1 X14 Y5
G1 Z5 F1000
"""


def files(folder, policy, text=SPREAD):
    (folder / "spread.yaml").write_text(text)
    (folder / "policy.yaml").write_text(f"compensation: {{policy: {policy}}}\n")
    return [w for each in (BASE, folder / "spread.yaml", folder / "policy.yaml") for w in ("--config", str(each))]


def compensate(folder, policy, program, text=SPREAD):
    out = {name: folder / name for name in ("o.nc", "j.csv", "s.json")}
    words = ["compensate", str(program), *files(folder, policy, text), "-o", str(out["o.nc"]), "-q"]
    assert run([*words, "--joints", str(out["j.csv"]), "--summary", str(out["s.json"])]) == 0
    figures = json.loads(out["s.json"].read_text())
    schemas.check("summary", figures)
    return table(out["j.csv"]), figures, out["o.nc"].read_text()


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The program under every policy: rows, figures, text and folder."""
    out = {}
    for policy in ("full", "shrink", "skip"):
        folder = tmp_path_factory.mktemp(policy)
        (folder / "p.nc").write_text(PROGRAM)
        out[policy] = (*compensate(folder, policy, folder / "p.nc"), folder)
    return out


def test_full_is_what_it_was_and_says_nothing_of_shares(whole, tmp_path):
    rows, figures, text, _ = whole["full"]
    assert "share" not in rows and "taken" not in figures
    (tmp_path / "p.nc").write_text(PROGRAM)
    _, _, exact = compensate(tmp_path, "full", tmp_path / "p.nc", "process: {}\n")
    assert text == exact


def test_a_shrunk_row_lies_between_the_programmed_and_the_corrected_tip(whole):
    rows, figures, _, _ = whole["shrink"]
    share = rows["share"]
    assert figures["taken"]["policy"] == "shrink" and figures["taken"]["shrunk"] > 10
    assert share.min() < 0.9 and share.max() == 1.0
    moved = np.linalg.norm([rows[f"{a}c_mm"] - rows[f"{a}_mm"] for a in "xyz"], axis=0)
    full = whole["full"][0]
    largest = np.linalg.norm([full[f"{a}c_mm"] - full[f"{a}_mm"] for a in "xyz"], axis=0).max()
    assert moved[share < 0.9].max() < largest
    assert figures["after"]["max_um"] > 50.0  # left on purpose, with an exit code of 0
    assert (rows["gain_um"][share > 0.0] > whole["full"][0]["gain_um"].min()).all()


def test_skipped_lines_stand_as_programmed_and_joining_lines_lead_there(whole):
    rows, figures, text, _ = whole["skip"]
    alone = np.unique(rows["line"][rows["share"] == 0.0])
    assert len(alone) and figures["taken"]["left_alone"] > 0 and set(np.unique(rows["share"])) == {0.0, 1.0}
    full = whole["full"][0]
    for line in np.unique(full["line"]):
        of = full["line"] == line
        inside = (full["band_um"][of] > full["gain_um"][of]).all()
        assert line in alone if inside else True
    lines = text.splitlines()
    number = int(alone[0])
    assert PROGRAM.splitlines()[number - 1] in lines
    assert figures["joining_lines"] >= whole["full"][1]["joining_lines"]


@pytest.mark.parametrize("policy", ["full", "shrink", "skip"])
def test_verify_repeats_the_figures_from_the_text(whole, policy, capsys):
    _, figures, _, folder = whole[policy]
    out = folder / "v.json"
    words = [
        "verify",
        str(folder / "o.nc"),
        "--against",
        str(folder / "p.nc"),
        *files(folder, policy),
        "--json",
        str(out),
    ]
    assert run(words) == 0, capsys.readouterr().err
    found = json.loads(out.read_text())
    schemas.check("verify", found)
    assert found["expected"]["rms_um"] == pytest.approx(figures["expected"]["rms_um"], rel=0.02)
    assert found["expected"]["p95_um"] == pytest.approx(figures["expected"]["p95_um"], rel=0.03)
    assert [each["input"] for each in found["band"]] == [each["input"] for each in figures["band"]]
    assert (policy == "full") == ("taken" not in found)
    assert "of this spread comes from the cutting force (cut)" in capsys.readouterr().err


def test_verify_refuses_a_program_that_took_another_share(whole, capsys):
    folder = whole["full"][3]
    words = ["verify", str(folder / "o.nc"), "--against", str(folder / "p.nc"), *files(folder, "shrink")]
    assert run(words) == 1
    said = capsys.readouterr().err
    assert "CC601" in said and "compensated for another machine or process" in said


@pytest.mark.parametrize("policy", ["shrink", "skip"])
def test_long_programs_take_the_same_shares(tmp_path, monkeypatch, policy):
    write(str(tmp_path / "p.nc"), 1300)
    monkeypatch.setattr(file_to_file, "LONG", 1)
    rows, figures, _ = compensate(tmp_path, policy, tmp_path / "p.nc")
    assert figures["interpolation"]["worst_um"] <= 0.05
    monkeypatch.setattr(file_to_file, "LONG", 1 << 30)
    exact, told, _ = compensate(tmp_path, policy, tmp_path / "p.nc")
    for line in np.unique(exact["line"]):
        ours, theirs = rows["share"][rows["line"] == line], exact["share"][exact["line"] == line]
        assert abs(ours[-1] - theirs[-1]) < 0.03, line
    assert figures["after"]["max_um"] == pytest.approx(told["after"]["max_um"], rel=0.02)
    assert bool(figures["taken"]["left_alone"]) == bool(told["taken"]["left_alone"])
