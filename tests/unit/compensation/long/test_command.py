"""`camcomp compensate` on long programs: the same outputs as on short ones, whatever is asked for."""

import csv
import io
import json
import sys

import numpy as np
import pytest

from camcomp.compensation import file_to_file
from camcomp.ground.files import shipped
from camcomp.terminal.cli import run
from tests.benchmarks.programs import groove

TEXT = "\n".join(groove(150)) + "\n"
CONFIG = str(shipped("config/cartesian.yaml"))


@pytest.fixture
def program(tmp_path):
    path = tmp_path / "p.nc"
    path.write_text(TEXT)
    return path


def compensate(program, *options, long):
    """Exit code of a run in which programs of `long` bytes are long."""
    before, file_to_file.LONG = file_to_file.LONG, long
    try:
        return run(["compensate", str(program), "--config", CONFIG, "--quiet", *map(str, options)])
    finally:
        file_to_file.LONG = before


def columns(data):
    rows = list(csv.reader(io.StringIO(data)))
    return rows[0], np.array(rows[1:], float)


def test_files_of_both_ways(program, tmp_path):
    made = {}
    for way, long in (("long", 1), ("short", 1 << 30)):
        names = [tmp_path / f"{way}.{each}" for each in ("nc", "csv", "json")]
        code = compensate(program, "-o", names[0], "--joints", names[1], "--summary", names[2], long=long)
        assert code == 0
        made[way] = [each.read_text() for each in names]
    assert made["long"][0] == made["short"][0]
    (head, values), (other_head, other) = (columns(made[way][1]) for way in made)
    assert head == other_head
    np.testing.assert_allclose(values, other, atol=2e-5, rtol=1e-6)
    figures, others = (json.loads(made[way][2]) for way in made)
    assert figures["interpolation"]["bound_um"] == 0.05 and figures["interpolation"]["worst_um"] <= 0.05
    assert set(figures) == {*others, "interpolation"} and figures["points"] == others["points"]


def test_standard_output_and_input(program, capfdbinary, monkeypatch):
    assert compensate(program, long=1) == 0
    once = capfdbinary.readouterr().out
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(TEXT.encode())))
    assert compensate("-", "-o", "-", long=1) == 0
    assert capfdbinary.readouterr().out == once != b""


def test_nothing_is_written_when_nothing_is_to_be_or_when_it_fails(program, tmp_path):
    out = tmp_path / "out.nc"
    assert compensate(program, "-o", out, "--dry-run", long=1) == 0 and not out.exists()
    program.write_text(TEXT.replace("M30", "X1,5"))
    assert compensate(program, "-o", out, long=1) == 3
    program.write_text(TEXT.replace("M30", "G1 X9e9"))
    assert compensate(program, "-o", out, long=1) == 3
    assert compensate(program, "-o", program, long=1) != 0
    assert sorted(each.name for each in tmp_path.iterdir()) == ["p.nc"]


def test_what_is_not_cut_into_pieces_goes_the_whole_way(program, tmp_path):
    program.write_text(TEXT.replace("M6", "M6\n#1=5\nG0 X#1"))
    a, b = tmp_path / "a.nc", tmp_path / "b.nc"
    assert compensate(program, "-o", a, long=1) == compensate(program, "-o", b, long=1 << 30) == 0
    assert a.read_bytes() == b.read_bytes()


def test_a_second_pass_is_refused(program, tmp_path):
    once = tmp_path / "once.nc"
    assert compensate(program, "-o", once, long=1) == 0
    assert compensate(once, "-o", tmp_path / "twice.nc", long=1) == 1


@pytest.mark.parametrize("long", [1, 1 << 30])
def test_parquet_holds_what_csv_holds(program, tmp_path, long):
    parquet = pytest.importorskip("pyarrow.parquet")
    table, text = tmp_path / "j.parquet", tmp_path / "j.csv"
    assert compensate(program, "--joints", table, long=long) == compensate(program, "--joints", text, long=long) == 0
    head, values = columns(text.read_text())
    read = parquet.read_table(table)
    assert read.column_names == head
    np.testing.assert_allclose(np.column_stack([each.to_numpy() for each in read.columns]), values, atol=6e-7)


def test_a_table_without_pyarrow_names_the_package(program, tmp_path, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    assert compensate(program, "--joints", tmp_path / "j.parquet", long=1) == 2
    assert "camcomp[parquet]" in capsys.readouterr().err
