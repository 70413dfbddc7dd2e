"""Progress on a terminal, silence elsewhere."""

import io
import time

import pytest

from camcomp.terminal import progress
from camcomp.terminal.cli import run
from tests.commandline import ROOT

WORDS = ["compensate", str(ROOT / "samples/groove-circle-2.nc"), "--config", str(ROOT / "config/cartesian.yaml")]


class Screen(io.StringIO):
    def __init__(self, is_terminal):
        super().__init__()
        self.isatty = lambda: is_terminal


@pytest.fixture
def screen(monkeypatch):
    def put(is_terminal=True, term="xterm"):
        made = Screen(is_terminal)
        monkeypatch.setattr("sys.stderr", made)
        monkeypatch.setenv("TERM", term)
        monkeypatch.setattr(progress, "PATIENCE", 0.01)
        monkeypatch.setattr(progress, "TICK", 0.01)
        return made

    return put


def test_long_work_is_told_and_wiped_away(screen):
    seen = screen()
    with progress.working("turning"):
        time.sleep(0.2)
    assert "turning ... 0 s" in seen.getvalue() and seen.getvalue().endswith("\r\033[K")


@pytest.mark.parametrize(
    ("is_terminal", "term", "quiet"), [(False, "xterm", False), (True, "dumb", False), (True, "xterm", True)]
)
def test_nothing_moves_where_it_should_not(screen, is_terminal, term, quiet):
    seen = screen(is_terminal, term)
    with progress.working("turning", quiet=quiet):
        time.sleep(0.05)
    assert seen.getvalue() == ""


def test_the_line_is_wiped_when_the_work_fails(screen):
    seen = screen()
    with pytest.raises(ZeroDivisionError), progress.working("turning"):
        raise ZeroDivisionError
    assert seen.getvalue().endswith("\r\033[K")


def test_quiet_compensation(capsys):
    assert run([*WORDS, "-q", "-o", "-"]) == 0
    out, err = capsys.readouterr()
    assert out.startswith("%") and err == ""


def test_a_dry_run_writes_nothing_and_says_what_it_would(tmp_path, capsys):
    out, summary = tmp_path / "o.nc", tmp_path / "s.json"
    assert run([*WORDS, "--dry-run", "-o", str(out), "--summary", str(summary)]) == 0
    told = capsys.readouterr()
    assert list(tmp_path.iterdir()) == [] and told.out == ""
    assert f"would write {out}: " in told.err and f"would write {summary}: " in told.err
    assert "tip error after" in told.err
    assert run([*WORDS, "--dry-run"]) == 0
    told = capsys.readouterr()
    assert told.out == "" and "would write -: " in told.err


def test_programs_go_through_pipes(capsys, monkeypatch):
    data = (ROOT / "samples/groove-circle-2.nc").read_bytes()
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(data)))
    assert run(["compensate", "-", *WORDS[2:], "-q"]) == 0
    piped = capsys.readouterr().out
    assert run([*WORDS, "-q"]) == 0
    assert capsys.readouterr().out == piped
