"""Bands of programs: against machines that really differ, beside effects, in tables and summaries, long programs included."""

import csv
import json

import numpy as np
import pytest

from camcomp.compensation.bands.scatter import TipMoves
from camcomp.compensation.bands.tip_field import TipField
from camcomp.compensation.program.compensate import compensate
from camcomp.ground.errors import PhysicsError
from camcomp.ground.files import shipped
from camcomp.model.config.load import load_config
from camcomp.model.control import program_of
from camcomp.model.job import Job
from camcomp.model.statics.solve import FREE, solve
from camcomp.terminal.cli import run
from tests import schemas

BASE = shipped("config/orthoglide-1deg.yaml")
PROGRAM = b"G21 G90 G17\nG0 X10 Y0 Z5\nG1 Z0 F300\nG3 X10 Y0 I-10 J0 F600\nG1 X20 Y8\nG1 X-20\nG1 Z5\n"
FORCE = "process: {force: {Fr_N: {sd: 30, group: cut}, Ft_N: {sd: 2, group: cut}, Fz_N: {sd: 4}}}\n"
TOOL = "tool: {length_mm: {value: 100, sd: 0.05}}\n"


def laid(tmp_path, text):
    over = tmp_path / "over.yaml"
    over.write_text(text)
    return [BASE, over]


def done(tmp_path, text, program=PROGRAM):
    config = load_config(laid(tmp_path, text))
    return compensate(program_of(program, "p.nc", config), Job(config), method="newton", tolerance_um=1.0, version="0")


def test_one_number_exact_gives_the_same_bytes(tmp_path):
    plain, more = done(tmp_path, "process: {}\n"), done(tmp_path, FORCE)
    assert plain.bands is None and more.bands is not None
    assert plain.written.data == more.written.data


def test_the_tool_that_is_longer_than_the_control_believes_moves_the_tip_by_as_much(tmp_path):
    result = done(tmp_path, TOOL)
    moves = result.bands.moves
    assert np.abs(moves.slope[:, 2, 0] + 0.05).max() < 2e-3  # mm, and the loads turn the platform a little
    assert np.abs(moves.slope[:, :2, 0]).max() < 2e-3
    assert result.bands.totals.shares() == [("tool.length_mm", 1.0)]


def test_an_uncertain_workpiece_moves_the_tip_the_other_way(tmp_path):
    result = done(tmp_path, "workpiece: {origin_mm: [{value: -73.205, sd: 0.02}, -73.205, -173.205]}\n")
    assert result.bands.moves.slope[:, :, 0] == pytest.approx(
        np.tile([-0.02, 0.0, 0.0], (len(result.rows.w), 1)), abs=1e-6
    )


def test_the_force_acts_through_the_compliance_and_not_in_the_air(tmp_path):
    result = done(tmp_path, FORCE)
    moves, cuts = result.bands.moves, result.rows.force.any(axis=1)
    assert np.linalg.norm(moves.slope, axis=(1, 2))[~cuts].max() == 0.0
    own = Job(load_config(laid(tmp_path, FORCE)))
    rows = np.flatnonzero(cuts & ~result.rows.joining)
    told = own.frame.to_machine(result.written.end[rows])
    force = own.frame.vectors(result.rows.force[rows])
    lateral = force[:, :2] / np.linalg.norm(force[:, :2], axis=1)[:, None]
    turned = np.column_stack((lateral, np.zeros(len(rows))))
    right = (215 * turned + 10 * np.cross([0, 0, 1.0], turned)) / np.hypot(215, 10)
    along = np.cross([0, 0, 1.0], right)
    assert np.abs(215 * right - 10 * along - [0, 0, 25] - force).max() < 0.2
    more = solve(own.real_machine, FREE, told, force=force + 3.0 * right + 0.2 * along).tip
    less = solve(own.real_machine, FREE, told, force=force - 3.0 * right - 0.2 * along).tip
    expected = (more - less) / 0.2
    found = moves.slope[rows][:, :, 0] @ own.frame.rotation.T
    assert np.abs(found - expected).max() < 0.01 * np.abs(expected).max()


def test_beside_effects_the_whole_way_is_solved_again(tmp_path):
    effects = "effects: [{effect: backlash, target: x, width_mm: {value: 0.02, sd: 0.004}}, {effect: drive_stiffness, target: y, factor: {value: 0.9, sd: 0.1}}]\n"
    result = done(tmp_path, effects)
    play = result.bands.moves.slope[:, 0, 0]
    cuts = np.flatnonzero(~result.rows.joining & result.rows.force.any(axis=1))
    assert np.median(np.abs(play[cuts])) == pytest.approx(0.002, rel=0.25)  # half the width, either way
    assert play[cuts].max() > 0.0 > play[cuts].min()
    assert {name for name, _ in result.bands.totals.shares()} == {"effects[1].width_mm", "effects[2].factor"}


def test_interpolated_moves_are_those_of_the_solver(tmp_path):
    text = FORCE + TOOL
    job = Job(load_config(laid(tmp_path, text)))
    random = np.random.default_rng(3)
    tips = random.uniform(-25.0, 25.0, (900, 3)) * [1.0, 1.0, 0.1]
    angle = random.uniform(0.0, 6.3, 900)
    force = np.column_stack((215.0 * np.cos(angle), 215.0 * np.sin(angle), np.full(900, -25.0)))
    moves, compliance = TipField(job).at(tips, force)
    some = slice(0, 30)
    exact, stiff = TipField(job).at(tips[some], force[some])
    assert isinstance(moves, TipMoves)
    assert np.abs(moves.slope[some] - exact.slope).max() < 0.03 * np.abs(exact.slope).max()
    assert np.abs(compliance[some] - stiff).max() < 0.03 * np.abs(stiff).max()


def test_a_spread_beyond_the_machine_is_told_with_its_place(tmp_path):
    soft = tmp_path / "soft.yaml"
    soft.write_text(BASE.read_text().replace("E_N_per_mm2: 70000", "E_N_per_mm2: {value: 70000, sd: 69990}"))
    config = load_config([soft])
    with pytest.raises(PhysicsError) as raised:
        compensate(program_of(PROGRAM, "p.nc", config), Job(config), method="newton", tolerance_um=1.0, version="0")
    assert raised.value.rule == "CC301" and raised.value.at.source.lstrip().startswith("E_N_per_mm2")


def test_tables_and_summary(tmp_path, capsys):
    (tmp_path / "p.nc").write_bytes(PROGRAM)
    files = [arg for each in laid(tmp_path, FORCE + TOOL) for arg in ("--config", str(each))]
    out = {name: str(tmp_path / name) for name in ("o.nc", "j.csv", "s.json")}
    assert (
        run(
            [
                "compensate",
                str(tmp_path / "p.nc"),
                *files,
                "-o",
                out["o.nc"],
                "--joints",
                out["j.csv"],
                "--summary",
                out["s.json"],
            ]
        )
        == 0
    )
    said = capsys.readouterr().err
    figures = json.loads((tmp_path / "s.json").read_text())
    schemas.check("summary", figures)
    low, high = figures["expected"]["rms_ci95_um"]
    assert low < figures["expected"]["rms_um"] < high and figures["expected"]["rms_um"] < figures["expected"]["p95_um"]
    assert sum(each["share"] for each in figures["band"]) == pytest.approx(1.0)
    assert [each["input"] for each in figures["band"]] == ["cut", "tool.length_mm", "process.force.Fz_N"]
    assert "of this spread comes from the cutting force (cut): cut two slots" in said
    with open(tmp_path / "j.csv") as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0])[-2:] == ["band_um", "gain_um"]
    assert 40.0 < max(float(row["band_um"]) for row in rows) < 300.0


def test_a_long_program_has_the_bands_of_a_short_one(tmp_path):
    from camcomp.compensation import file_to_file
    from tests.benchmarks.programs import write

    write(str(tmp_path / "p.nc"), 3000)
    files = [arg for each in laid(tmp_path, FORCE + TOOL) for arg in ("--config", str(each))]
    tables, figures = [], []
    for long in (1, 1 << 30):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(file_to_file, "LONG", long)
            wanted = ["--joints", str(tmp_path / "j.csv"), "--summary", str(tmp_path / "s.json")]
            assert run(["compensate", str(tmp_path / "p.nc"), *files, *wanted]) == 0
        tables.append(np.genfromtxt(tmp_path / "j.csv", delimiter=",", names=True))
        figures.append(json.loads((tmp_path / "s.json").read_text()))
    assert "interpolation" in figures[0] and figures[1].get("interpolation") is None
    ours, exact = tables
    assert len(ours) == len(exact)
    for name in ("band_um", "gain_um"):
        assert np.nanmax(np.abs(ours[name] - exact[name])) < 0.03 * np.nanmax(np.abs(exact[name])), name
    assert figures[0]["expected"]["rms_um"] == pytest.approx(figures[1]["expected"]["rms_um"], rel=0.02)
    assert figures[0]["expected"]["p95_um"] == pytest.approx(figures[1]["expected"]["p95_um"], rel=0.05)
