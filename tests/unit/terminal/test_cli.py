import os
import signal
import subprocess
import sys
from importlib import import_module

import click
import pytest

from camcomp.ground.errors import CheckFailed, ConfigError, FileError, PhysicsError, ProgramError
from camcomp.terminal import cli


def verbs():
    return cli.cli.list_commands(click.Context(cli.cli))


def camcomp(*args, **environment):
    return subprocess.run(
        [sys.executable, "-m", "camcomp", *args],
        check=False, capture_output=True, text=True, timeout=60, env={**os.environ, **environment},
    )  # fmt: skip


@pytest.fixture
def verb(monkeypatch):
    """Put a function in the place of a verb called `test`."""

    def put(function):
        command = click.command()(function)
        monkeypatch.setattr(cli.cli, "list_commands", lambda ctx: ["test"])
        monkeypatch.setattr(cli.cli, "get_command", lambda ctx, name: command)

    return put


def raising(error):
    def function():
        raise error

    return function


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (CheckFailed("CC200", "text"), 1),
        (ConfigError("CC200", "text"), 2),
        (ProgramError("CC200", "text"), 3),
        (PhysicsError("CC200", "text"), 4),
        (FileError("CC500", "text"), 5),
        (click.UsageError("text"), 2),
        (click.FileError("name", "text"), 5),
        (OSError(28, "text", "name"), 5),
        (ImportError("text.so: failed to map segment from shared object"), 5),
        (KeyboardInterrupt(), 130),
        (click.Abort(), 130),
        (ZeroDivisionError("text"), 70),
    ],
)
def test_exit_codes(verb, capsys, error, code):
    verb(raising(error))
    assert cli.run(["test"]) == code
    out, err = capsys.readouterr()
    assert out == ""
    assert "text" in err or code == 130
    assert "Traceback" not in err


def test_success_and_codes_given_back(verb):
    verb(lambda: None)
    assert cli.run(["test"]) == 0
    verb(lambda: 1)
    assert cli.run(["test"]) == 1


def test_a_bug_is_called_one_and_shows_its_traceback_when_asked(verb, capsys, monkeypatch):
    verb(raising(ZeroDivisionError("text")))
    cli.run(["test"])
    assert "This is a bug in camcomp" in capsys.readouterr().err
    monkeypatch.setenv("CAMCOMP_DEBUG", "1")
    cli.run(["test"])
    assert "Traceback" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("terminal", "no_color", "colored"), [(True, "", True), (True, "1", False), (False, "", False)]
)
def test_color_only_on_a_terminal_that_wants_it(verb, capsys, monkeypatch, terminal, no_color, colored):
    verb(raising(ConfigError("CC200", "text")))
    monkeypatch.setattr(sys.stderr, "isatty", lambda: terminal)
    monkeypatch.setenv("NO_COLOR", no_color)
    monkeypatch.setenv("TERM", "xterm")
    cli.run(["test"])
    assert ("\033[" in capsys.readouterr().err) == colored


def test_usage_errors(capsys):
    assert cli.run(["expalin"]) == 2
    assert "Did you mean 'explain'?" in capsys.readouterr().err
    assert cli.run(["explain", "--no-such-option"]) == 2
    assert cli.run(["validate"]) == 2


def test_help_and_version(capsys):
    assert cli.run(["--help"]) == 0
    assert "explain" in capsys.readouterr().out
    assert cli.run(["--version"]) == 0
    assert capsys.readouterr().out.startswith("camcomp 0.")


def test_the_table_of_verbs_says_what_the_verbs_say():
    said = {name: cli.VERBS.get(name) for name in verbs()}
    assert said == {
        name: (import_module(f"camcomp.terminal.commands.{name}").command.help or "").split("\n")[0] for name in verbs()
    }


def test_help_imports_neither_numbers_nor_yaml():
    code = "import sys\nfrom camcomp.terminal.cli import run\nassert run(['--help']) == 0\nprint(sorted(sys.modules))"
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    heavy = {"numpy", "scipy", "numba", "pydantic", "ruamel.yaml", "pygcode"}
    assert not [name for name in heavy if f"'{name}'" in out]
    assert "'click'" in out


def test_a_reader_that_goes_away_is_no_error():
    done = subprocess.run(
        f"{sys.executable} -m camcomp schema | head -c 10",
        shell=True,
        check=False,
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert done.stdout == '{\n "$schem'
    assert done.stderr == ""


def test_as_a_process():
    assert camcomp("explain", "CC201").returncode == 0
    missing = camcomp("config", "show", "--config", "no-such-file.yaml")
    assert (missing.returncode, missing.stdout) == (5, "")
    assert missing.stderr.startswith("camcomp: error[CC500]")


def test_shell_completion():
    done = camcomp(_CAMCOMP_COMPLETE="bash_complete", COMP_WORDS="camcomp ex", COMP_CWORD="1")
    assert done.stdout == "plain,explain\n"


def test_what_goes_wrong_for_lack_of_memory_is_no_bug(verb, capsys, monkeypatch):
    verb(raising(MemoryError()))
    assert cli.run(["test"]) == 5
    assert "not enough memory" in capsys.readouterr().err
    monkeypatch.setattr(cli, "ENOUGH", 1 << 62)
    verb(raising(ValueError("field 'target' is required for AnnAssign")))
    assert cli.run(["test"]) == 5
    assert "not enough memory" in capsys.readouterr().err


@pytest.mark.parametrize(("number", "code"), [(signal.SIGTERM, 143), (signal.SIGHUP, 129), (signal.SIGINT, 130)])
def test_a_signal_ends_a_command_in_the_middle_and_leaves_nothing(tmp_path, number, code):
    """It is waiting for its program with an output open next to its target: on a system whose files all have names."""
    script = (
        "import os, sys; vars(os).pop('O_TMPFILE', None); from camcomp.ground import files; from camcomp.terminal import cli\n"
        "import click\n"
        "@click.command()\n"
        "def test():\n"
        "    with files.writing(['out']) as opened:\n"
        "        opened['out'].write(b'half'); print('ready', flush=True); sys.stdin.read()\n"
        "cli.cli.list_commands = lambda ctx: ['test']\n"
        "cli.cli.get_command = lambda ctx, name: test\n"
        "cli.main(['test'])\n"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", script], cwd=tmp_path, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        text=True,
    )  # fmt: skip
    assert process.stdout.readline() == "ready\n"
    assert len(list(tmp_path.iterdir())) == 1
    process.send_signal(number)
    said = process.communicate(timeout=20)[1]
    assert (process.returncode, list(tmp_path.iterdir())) == (code, []) and "Traceback" not in said


@pytest.mark.parametrize(("words", "code"), [(["--version"], 0), (["explain", "nothing"], 2)])
def test_the_end_of_a_process_runs_exit_functions_and_keeps_output_and_code(words, code):
    script = "import atexit, os; atexit.register(os.write, 2, b'the end')\nfrom camcomp.__main__ import main; main()"
    done = subprocess.run(
        [sys.executable, "-c", script, *words], check=False, capture_output=True, text=True, timeout=60
    )
    assert done.returncode == code and done.stderr.endswith("the end")
    assert bool(done.stdout) == (code == 0)
