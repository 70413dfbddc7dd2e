"""Two tables side by side: aligned by place or time, the difference found where it was planted."""

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camcomp.diagnosis.compare import compare, default_key
from camcomp.terminal.cli import run
from tests.commandline import ROOT


def curve(s):
    return {"line": np.full(len(s), 7.0), "s_mm": s, "x_mm": np.sin(s), "y_mm": np.cos(s), "z_mm": 0.0 * s}


def of(result, column):
    (found,) = [each for each in result.differences if each.column == column]
    return found


def test_a_table_equals_itself():
    table = curve(np.linspace(0, 3, 50))
    result = compare(table, table)
    assert (result.by, result.rows, result.unmatched) == ("s_mm", 50, 0)
    assert all(each.most == each.rms == 0.0 and each.rows == 50 for each in result.differences)


@given(
    n=st.integers(20, 60),
    m=st.integers(20, 60),
    at=st.integers(1, 18),
    size=st.floats(0.1, 5.0),
    seed=st.integers(0, 99),
)
def test_a_planted_difference_is_found_on_other_rows(n, m, at, size, seed):
    rng = np.random.default_rng(seed)
    a = curve(np.sort(rng.uniform(0.0, 3.0, n)))
    s = np.concatenate(([0.0], np.sort(rng.uniform(0.0, 3.0, m)), [3.0]))
    b = {**curve(s), "x_mm": np.interp(s, np.linspace(0, 3, 200), np.sin(np.linspace(0, 3, 200)))}
    a["x_mm"][at] -= size
    chord = np.diff(s).max() ** 2 / 8 + 1e-4
    found = of(compare(a, b), "x_mm")
    assert abs(found.most - size) <= chord
    assert (found.line, found.a) == (7, a["x_mm"][at]) or size <= 2 * chord
    assert of(compare(a, b), "distance(x_mm,y_mm,z_mm)").most >= found.most - 1e-12


def test_jumps_are_paired_in_order():
    s = np.array([0.0, 1.0, 1.0, 2.0])
    a = {"line": np.array([3.0, 3.0, 4.0, 4.0]), "s_mm": s, "fx_N": np.array([0.0, 0.0, 100.0, 100.0])}
    b = {"line": np.array([3.0, 3.0, 4.0, 4.0, 4.0]), "s_mm": np.array([0.0, 1.0, 1.0, 1.5, 2.0]),
         "fx_N": np.array([0.0, 0.0, 100.0, 100.0, 100.0])}  # fmt: skip
    for one, other in ((a, b), (b, a)):
        for by in ("s_mm", None):
            assert of(compare(one, other, by), "fx_N").most == 0.0
    without = [{k: v for k, v in each.items() if k != "line"} for each in (a, b)]
    assert of(compare(*without), "fx_N").most == 0.0


def test_the_move_into_a_line_starts_at_the_line_before():
    a = {"line": np.array([3.0, 4.0, 4.0]), "s_mm": np.array([1.0, 2.0, 3.0]), "q_mm": np.array([1.0, 2.0, 3.0])}
    b = {"line": np.array([3.0, 4.0]), "s_mm": np.array([1.0, 3.0]), "q_mm": np.array([1.0, 3.5])}
    result = compare(a, b)
    assert (result.unmatched, result.interpolated) == (0, 1)
    assert of(result, "q_mm").most == pytest.approx(0.5) and of(result, "q_mm").rms == pytest.approx(
        np.sqrt(0.3125 / 3)
    )


def test_logs_by_time_outside_of_each_other_and_with_empty_cells():
    t = np.arange(10.0)
    a = {"t_s": t, "x_mm": t.copy(), "temp_C": np.full(10, 20.0)}
    b = {"t_s": t + 2.5, "x_mm": t + 2.0, "temp_C": np.full(10, np.nan)}
    a["x_mm"][5] = np.nan
    result = compare(a, b)
    assert (result.by, result.unmatched) == ("t_s", 3)
    assert of(result, "x_mm").rows == 6 and of(result, "x_mm").mean == pytest.approx(0.5)
    assert of(result, "temp_C").rows == 0


def test_what_cannot_be_aligned_is_refused():
    a = curve(np.linspace(0, 1, 5))
    with pytest.raises(ValueError, match="A has line 7, B 8"):
        compare(a, {**a, "line": a["line"] + 1})
    with pytest.raises(ValueError, match="runs backwards"):
        compare(a, {**a, "s_mm": a["s_mm"][::-1].copy()})
    with pytest.raises(ValueError, match="no column in common"):
        compare(a, {"s_mm": a["s_mm"]})
    with pytest.raises(ValueError, match="t_s is not in both"):
        compare(a, a, "t_s")
    assert default_key(a, {"t_s": a["s_mm"]}) == "row"


@pytest.fixture
def joints(tmp_path, monkeypatch):
    """Joint tables of one program at two tolerances, so with different rows."""
    monkeypatch.chdir(tmp_path)
    for name, tolerance in (("coarse", 2), ("fine", 0.5)):
        words = ["compensate", ROOT / "samples/groove-circle-2.nc", "--config", ROOT / "config/cartesian.yaml", "-q"]
        assert run([str(each) for each in (*words, "--joints", f"{name}.csv", "--tolerance-um", tolerance)]) == 0
    return tmp_path


def test_joint_tables_of_two_tolerances(joints, capsys):
    assert run(["compare", "fine.csv", "coarse.csv", "--json", "c.json"]) == 0
    out = capsys.readouterr().out
    told = json.loads((joints / "c.json").read_text())
    columns = {each["column"]: each for each in told["differences"]}
    assert told["by"] == "s_mm" and told["unmatched"] == 0
    assert 1e-4 < columns["distance(xc_mm,yc_mm,zc_mm)"]["most"] < 4e-3
    assert columns["distance(x_mm,y_mm,z_mm)"]["most"] < 4e-3
    assert columns["xc_mm"]["line"] == 9
    assert len((joints / "fine.csv").read_text()) > len((joints / "coarse.csv").read_text())
    assert out.splitlines()[0].split()[:4] == ["column", "rows", "max", "rms"]
    assert any(line.startswith("distance(xc_mm,yc_mm,zc_mm)") for line in out.splitlines())


def test_tolerances_decide(joints, capsys):
    words = ["compare", "fine.csv", "coarse.csv"]
    assert run([*words, "--tolerance", "xc_mm=0.01", "--tolerance", "act_x_mm=0.01"]) == 0
    assert run([*words, "--tolerance", "xc_mm=1e-6"]) == 1
    assert "error[CC606]: xc_mm differs by" in capsys.readouterr().err
    assert run([*words, "--tolerance", "1e-6", "--column", "z_mm"]) == 0
    assert run([*words, "--tolerance", "1e-6"]) == 1
    capsys.readouterr()
    assert run([*words, "--column", "q_mm"]) == 2
    assert "there are x_mm, " in capsys.readouterr().err
    assert run([*words, "--tolerance", "xc_mm=small"]) == 2


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "the file is empty"),
        ("a,b\n", "no rows"),
        ("a,a\n1,2\n", "column a stands there twice"),
        ("a,b\n1,2\n\n1,x\n", "bad.csv:4:3: error[CC450]: 'x' in column b"),
        ("a,b\n1\n", "bad.csv:2:1: error[CC450]: 1 cells under 2"),
        ("a,b\r1,2\r1,x\r", "bad.csv:3:3: error[CC450]: 'x' in column b"),
        ("a,b\n1,2\n1,-inf\n", "bad.csv:3:3: error[CC450]: '-inf' in column b is not a number"),
    ],
)
def test_tables_that_are_none(joints, capsys, text, told):
    (joints / "bad.csv").write_text(text)
    assert run(["compare", "fine.csv", "bad.csv"]) == 2
    assert told in capsys.readouterr().err
