"""Progress: a line drawn anew on a terminal, seldom lines elsewhere, nothing when quiet."""

import io
import os
import re
import subprocess
import sys
import time

import numpy as np
import pytest

import camcomp
from camcomp.api.recordings import import_recordings
from camcomp.diagnosis.arm.poses import Poses
from camcomp.diagnosis.axis.findings import AxisRun
from camcomp.ground import progress as reported
from camcomp.model.config.load import load_config
from camcomp.model.statics.build import build_robot
from camcomp.terminal import progress
from camcomp.terminal.cli import run
from tests.commandline import ROOT
from tests.studies import arm_study, axis_study
from tests.validation.plants.arm_poses import measured

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


def lines(seen):
    """What stood on the screen, one after the other."""
    return [each.removeprefix("\033[K") for each in seen.getvalue().split("\r") if each not in ("", "\033[K")]


def test_share_and_remaining_time_are_told(screen, monkeypatch):
    seen = screen()
    with progress.working("turning"), reported.part(0.0, 0.5):
        began = time.time()
        monkeypatch.setattr("click._termui_impl.time.time", lambda: began + 3.0)
        reported.done(0.5)
        time.sleep(0.1)
    told = lines(seen)
    assert any("turning  [======                  ]   25%" in each for each in told)
    assert any(re.search(r"25%  00:00:0[89] left$", each) for each in told), told  # 3 s for a quarter


def test_what_holds_up_the_work_is_told_instead(screen):
    seen = screen()
    with progress.working("turning"):
        reported.done(0.5)
        reported.hold(reported.ONCE)
        time.sleep(0.1)
        reported.hold("")
        time.sleep(0.1)
    told = lines(seen)
    assert told[0] == "turning ... compiling, once per installation, 0 s"
    assert "50%" in told[-1]


@pytest.fixture
def shares(monkeypatch):
    """Shares of the work around the test, as they were said."""
    seen = []
    original = reported.done

    def note(share):
        original(share)
        if reported._watched:
            seen.append(reported._watched[-1].share)

    monkeypatch.setattr(reported, "done", note)
    return seen


def test_programs_say_how_far_they_are(shares):
    """Shares rise to the end, in more than a few steps."""
    groove, machine = WORDS[1], camcomp.load_machine(WORDS[3])
    with reported.watched() as watched:
        done = camcomp.compensate(groove, machine)
        assert_rising(shares, watched)
        watched.share = None
        shares.clear()
        camcomp.verify(done.data, groove, machine)
    assert_rising(shares, watched)


@pytest.mark.campaign  # axes are in the plain run
def test_a_diagnosis_says_how_far_it_is(shares):
    with reported.watched() as watched:
        camcomp.diagnose(ROOT / "samples/diagnosis/ambiguous/experiment.yaml")
    assert_rising(shares, watched)


def test_an_arm_says_how_far_it_is(shares):
    q = np.random.default_rng(1).uniform(-1.0, 1.0, (60, 6))
    poses = Poses(
        label="A", q=q, tip=measured(q, 1, longer=0.7), time=np.arange(60.0), temperature=None, run=np.full(60, "A")
    )
    robot = build_robot(load_config([ROOT / "config/ur10.yaml"]).robot, [0.0, 0.0, 0.0])[0]
    with reported.watched() as watched:
        arm_study(robot, (), [poses], without=["joint_curve"])
    assert_rising(shares, watched)


def test_axes_say_how_far_they_are(shares):
    t = np.arange(0.0, 4.0, 0.01)
    where, force = 100.0 * np.sin(2.0 * t), 50.0 * np.sign(np.cos(2.0 * t))
    runs = [
        AxisRun(
            name=f"r{k}",
            time=t,
            setpoint=where,
            encoder=where - 0.01 * np.cos(2.0 * t),
            force=force,
            row=np.arange(400),
        )
        for k in range(2)
    ]
    with reported.watched() as watched:
        axis_study({"x": runs, "y": runs}, holdout=["r1"])
    assert_rising(shares, watched, least=2)


def test_a_simulation_says_how_far_it_is(shares):
    with reported.watched() as watched:
        log = camcomp.simulate(WORDS[1], camcomp.load_machine(WORDS[3]))
    assert_rising(shares, watched)
    with reported.watched() as watched:
        shares.clear()
        log.to_csv()
    assert shares == [0.0] and watched.share == 0.0  # of a short log


def test_an_import_says_how_far_it_is(shares, tmp_path):
    rows = "".join(f"{k / 100},{k},{k},{k},{k},{k},{k},0,0,0\n" for k in range(50))
    for name in "abc":
        (tmp_path / f"{name}.csv").write_text(
            "t_s,cmd_x_mm,cmd_y_mm,cmd_z_mm,act_x_mm,act_y_mm,act_z_mm,act_x_N,act_y_N,act_z_N\n" + rows
        )
    files = [str(tmp_path / f"{name}.csv") for name in "abc"]
    with reported.watched() as watched:
        import_recordings(files, [WORDS[3]], tmp_path / "out", columns=[])
    assert_rising(shares, watched)


def assert_rising(shares, watched, least=3):
    assert shares == sorted(shares) and 0.0 <= shares[0] < 0.6 and 0.85 < watched.share <= 1.0
    assert len({round(each, 3) for each in shares}) >= least


@pytest.mark.parametrize("verb", ["simulate", "import"])
def test_verbs_tell_it_on_a_terminal_and_nowhere_else(screen, tmp_path, monkeypatch, verb):
    """The duration of the work is free; the display of its progress is tested."""
    told = []
    monkeypatch.setattr(progress._Line, "text", lambda self, reported: told.append(self._on) or self._on)
    pause = reported.done
    monkeypatch.setattr(reported, "done", lambda share: (time.sleep(0.05), pause(share)))
    log = tmp_path / "a.csv"
    words = ["simulate", WORDS[1], *WORDS[2:], "--step-s", "0.5"]
    assert run([*words, "-o", str(log)]) == 0
    if verb == "import":
        words = ["import", str(log), *WORDS[2:]]
    for is_terminal in (True, False):
        screen(is_terminal)
        told.clear()
        assert run([*words, "-o", str(tmp_path / f"out-{is_terminal}")]) == 0
        assert bool(told) == is_terminal


def test_a_quiet_simulation_writes_its_log_alone(tmp_path, capsys):
    program, words = tmp_path / "short.nc", ["--config", WORDS[3], "--step-s", "0.1"]
    program.write_text("G21 G90 G17 G94\nM5\nG0 X0 Y0 Z0\nG1 X2 F600\nM2\n")
    said = []
    for more in ([], ["-q"]):
        assert run(["simulate", str(program), *words, *more]) == 0
        said.append(capsys.readouterr())
    assert said[0].out == said[1].out != ""
    assert "spindle stopped" in said[0].err
    assert said[1].err == ""


def test_long_programs_say_how_far_they_are(tmp_path):
    program = tmp_path / "long.nc"
    moves = (f"G1 X{k % 97 / 10:.4f} Y{k % 89 / 10:.4f} F600" for k in range(45_000))
    program.write_text("G21 G90 G17 G94\nS8000 M3\nG0 X0 Y0 Z0\n" + "\n".join(moves) + "\nM2\n")
    shares = []
    with reported.watched() as watched:
        rest = reported.done

        def note(share):
            rest(share)
            shares.append(watched.share)

        with pytest.MonkeyPatch.context() as patch:
            patch.setattr("camcomp.compensation.long.program.done", note)
            patch.setattr("camcomp.compensation.long.runs.CHUNK_BYTES", 1 << 18)
            assert run(["compensate", str(program), *WORDS[2:], "-q", "-o", str(tmp_path / "out.nc")]) == 0
    assert shares == sorted(shares) and shares[0] < 0.1 and 0.5 < shares[-1] < 1.0


def test_pipes_stay_silent_while_the_share_is_known(screen):
    seen = screen(is_terminal=False)
    with progress.working("turning"):
        reported.done(0.5)
        time.sleep(0.05)
    assert seen.getvalue() == ""


def test_logs_get_a_line_now_and_then_with_share_and_remaining_time(screen, monkeypatch):
    seen = screen(is_terminal=False)
    monkeypatch.setattr(progress, "SELDOM", 0.05)
    with progress.working("turning"):
        time.sleep(0.07)
        began = time.monotonic()
        monkeypatch.setattr(progress.time, "monotonic", lambda: began + 90.0)
        reported.done(0.25)
        time.sleep(0.07)
    told = seen.getvalue().splitlines()
    assert told[0] == "turning: 0 s so far"
    assert re.fullmatch(r"turning: 25 %, about 4 min (29|30|31) s left", told[1]), told
    with progress.working("turning", quiet=True):
        time.sleep(0.07)
    assert seen.getvalue().splitlines() == told


def test_what_is_said_meanwhile_has_a_line_of_its_own(screen):
    seen = screen()
    with progress.working("turning"):
        time.sleep(0.05)
        progress.say("a program is done")
    assert "\r\033[Ka program is done\n" in seen.getvalue()
    progress.say("the end")
    assert seen.getvalue().endswith("\r\033[Kthe end\n")


def test_a_batch_says_how_far_it_is(screen, tmp_path, monkeypatch):
    for name in "ab":
        (tmp_path / f"{name}.nc").write_text("G21 G90\nG0 X0 Y0 Z0\nG1 X1 F600\nM2\n")
    screen(is_terminal=False)
    told = []
    original = reported.done
    monkeypatch.setattr(reported, "done", lambda share: (original(share), told.append(reported._watched[0].share)))
    words = ["batch", str(tmp_path), *WORDS[2:], "--output-dir", str(tmp_path / "out"), "--jobs", "1"]
    assert run(words) == 0
    assert [each for each in dict.fromkeys(told) if each is not None] == [0.5, 1.0]


def test_compiling_is_told_for_what_it_is(tmp_path):
    """A first run in an installation without machine code says so; the second compiles no code."""
    code = """
import numpy as np, sys
from camcomp.ground import progress as reported
told = []
reported.hold = told.append
from camcomp.ground import compiled
sys.path.insert(0, sys.argv[1])
import kernel
kernel.twice(np.zeros(3))
print("|".join(told))
"""
    kernel = "from camcomp.ground.compiled import entry\n@entry\ndef twice(x):\n    x[0] = 2.0 * x[0]\n"
    (tmp_path / "kernel.py").write_text(kernel)
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache"), "PYTHONPATH": str(ROOT)}
    first, second = (
        subprocess.run(
            [sys.executable, "-c", code, str(tmp_path)], env=environment, capture_output=True, text=True, check=True
        )
        for _ in range(2)
    )
    assert first.stdout.strip() == f"{reported.ONCE}|" and second.stdout.strip() == ""


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
