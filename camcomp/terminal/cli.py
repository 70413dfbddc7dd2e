"""The command line: verbs found by file name in terminal/commands and imported when called; errors to exit codes.

0 done · 1 a check failed · 2 usage, YAML · 3 NC program · 4 physics · 5 input, output · 70 bug in camcomp ·
130 interrupted · 141 the reader of our output went away · 143 ended by SIGTERM, 129 by SIGHUP.
"""

import os
import signal
import sys
import warnings
from _thread import interrupt_main
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from importlib import import_module
from threading import Timer, main_thread
from types import FrameType
from typing import Any, TextIO

import click

from camcomp import __version__
from camcomp.ground.errors import CamcompError, ConfigError, FileError, PluginWarning, Terminated, format_error, shown
from camcomp.ground.files import remembering_inputs
from camcomp.terminal.standard_streams import stand_in_for_closed

# Threads of the linear algebra slow small matrices down, in particular on a busy machine. The variables have to be set
# before numpy is imported; a setting of the user has precedence.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

COMPLETING = "_CAMCOMP_COMPLETE"  # variable by which a shell asks for completions
SHORT_OF_MEMORY = "there is not enough memory"
SOON_S = 0.02  # longer than the finalisation of any object
ENOUGH = 1 << 26  # bytes; less than every verb with computations needs

# One line per verb, so that `camcomp --help` imports none of them; a test compares the table with the commands.
VERBS = {
    "batch": "Compensate many programs at once.",
    "canon": "Print the motions of a program as camcomp reads them, one line each.",
    "compare": "Compare two logs or joint tables of one program.",
    "compensate": "Write the deflection of the machine back into an NC program.",
    "config": "Show the values in force of several YAML files, or write a screw file.",
    "diagnose": "Find out why a machine and its model differ.",
    "effects": "List the effects by which a machine can differ from its model.",
    "explain": "Explain a rule id of an error message.",
    "history": "Store the diagnoses of a machine and show the drift of its parameters.",
    "import": "Turn recordings of others into logs and an experiment file.",
    "init": "Start a project: a machine file, a program, a README.",
    "place": "Find where on the table a program is cut best: with the least error that compensation cannot be trusted to remove.",
    "schema": "Print the JSON schema of the YAML files, or of a result.",
    "simulate": "Write the log that the modelled machine would produce.",
    "stream": "Compensate single set-points, line by line, from standard input to standard output.",
    "tutorial": "Write the tutorial with its samples and machine files into a folder.",
    "validate": "Check YAML files and NC programs; report every error at once.",
    "verify": "Run a compensated program through the model and measure the residual error.",
}


class _Verbs(click.Group):
    """Commands by file name."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        files = os.listdir(os.path.join(os.path.dirname(__file__), "commands"))
        return sorted(each[:-3] for each in files if each.endswith(".py") and not each.startswith("_"))

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in self.list_commands(ctx):
            return None
        out: click.Command = import_module(f"camcomp.terminal.commands.{cmd_name}").command
        if COMPLETING in os.environ:
            from camcomp.terminal.completion import complete_values

            return complete_values(out)
        return out

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl([(name, VERBS.get(name, "")) for name in self.list_commands(ctx)])

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        if args[0] not in self.list_commands(ctx) and not args[0].startswith("-"):
            from difflib import get_close_matches

            close = get_close_matches(args[0], self.list_commands(ctx), n=1)
            ctx.fail(f"No such command '{args[0]}'." + (f" Did you mean '{close[0]}'?" if close else ""))
        return super().resolve_command(ctx, args)


@click.group(cls=_Verbs, context_settings={"help_option_names": ["-h", "--help"], "auto_envvar_prefix": "CAMCOMP"})
@click.version_option(__version__, prog_name="camcomp", message="%(prog)s %(version)s")
def cli() -> None:
    """G-code and a machine file in, G-code that makes up for the machine's compliance out."""


def _terminate(number: int, _frame: FrameType | None) -> None:
    raise Terminated(number)


def _send_again(dropped: "sys.UnraisableHookArgs") -> None:
    """Repeat a signal a moment later if it came during the finalisation of an object, where Python drops exceptions."""
    error = dropped.exc_value
    if not isinstance(error, KeyboardInterrupt | Terminated):
        sys.__unraisablehook__(dropped)
        return
    number = error.number if isinstance(error, Terminated) else signal.SIGINT
    again = Timer(SOON_S, _interrupt, (number,))
    again.daemon = True
    try:
        again.start()  # which waits for the thread
    except (KeyboardInterrupt, Terminated):  # the repetition came while this hook was still running
        _send_again(dropped)


def _interrupt(number: signal.Signals) -> None:
    """Send a signal to the main thread, which also interrupts its waiting calls where the system permits it."""
    if hasattr(signal, "pthread_kill"):
        signal.pthread_kill(main_thread().ident or 0, number)
    else:
        interrupt_main(number)


def _end_on_signals() -> None:
    sys.unraisablehook = _send_again
    for name in ("SIGTERM", "SIGHUP"):
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) is signal.SIG_DFL:  # nohup ignores one
            signal.signal(number, _terminate)


def main(args: list[str] | None = None) -> None:
    """Run the command line and leave the process with the exit code of the contract."""
    stand_in_for_closed()
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")  # saves a search through all installed packages
    _end_on_signals()
    code = run(sys.argv[1:] if args is None else args)
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except OSError:
            _forget(stream)  # the error was reported when it occurred, or cannot be
    sys.exit(code)


def run(args: list[str]) -> int:
    """Run one command line; the exit code. Messages go to standard error."""
    if COMPLETING in os.environ:
        from click.shell_completion import shell_complete

        return shell_complete(cli, {}, "camcomp", COMPLETING, os.environ[COMPLETING])
    try:
        with remembering_inputs(), _plugins_left_out(), cli.make_context("camcomp", list(args)) as context:
            code = cli.invoke(context)
        sys.stdout.flush()
        return code if isinstance(code, int) else 0
    except CamcompError as error:
        return _report(error)
    except click.exceptions.Exit as stop:
        return stop.exit_code
    except click.exceptions.FileError as error:
        return _report(FileError("CC500", f"cannot open {error.ui_filename}: {error.message}"))
    except click.ClickException as error:
        with suppress(OSError):
            error.show()
        return 2
    except (KeyboardInterrupt, click.Abort):
        _tell("camcomp: interrupted")
        return 130
    except Terminated as end:
        _tell("camcomp: terminated")
        return 128 + end.number
    except BrokenPipeError:
        _forget(sys.stdout)
        return 141
    except OSError as error:
        name = f"{error.filename}: " if error.filename else ""
        return _report(FileError("CC503", f"{name}{error.strerror or error}"))
    except MemoryError:
        return _report(FileError("CC503", SHORT_OF_MEMORY))
    except ImportError as error:
        if isinstance(error, ModuleNotFoundError):
            return _bug(error)
        return _report(FileError("CC503", f"a library cannot be loaded: {error}"))
    except Exception as error:  # noqa: BLE001 - any other exception is a bug and reported as one
        if _short_of_memory():
            return _report(FileError("CC503", SHORT_OF_MEMORY))
        return _report(_settings_of_numba(error)) if _is_from_import_of_numba(error) else _bug(error)


def _is_from_import_of_numba(error: Exception) -> bool:
    """Whether the import of numba failed, which reads its settings and raises various errors about them."""
    place = error.__traceback__
    while place is not None:
        if place.tb_frame.f_globals.get("__name__") == "numba":
            return place.tb_frame.f_code.co_name == "<module>"
        place = place.tb_next
    return False


def _settings_of_numba(error: Exception) -> ConfigError:
    reason = (str(error) or type(error).__name__).splitlines()[0]
    hint = "look at the environment variables NUMBA_* and at .numba_config.yaml in the current folder"
    return ConfigError("CC205", f"numba does not start: {reason}", hint=hint)


def _short_of_memory() -> bool:
    """Whether free memory is below ENOUGH, which makes Python and libraries fail with misleading errors."""
    try:
        bytearray(ENOUGH)
    except MemoryError:
        return True
    return False


def _forget(stream: TextIO) -> None:
    """Redirect a standard stream to the null device, because Python flushes it once more at exit."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


@contextmanager
def _plugins_left_out() -> Iterator[None]:
    """Context that prints warnings about users' plug-ins like errors, each once; other warnings are unchanged."""
    with warnings.catch_warnings():
        warnings.simplefilter("always", PluginWarning)
        others, told = warnings.showwarning, set()

        def show(message: Warning | str, category: type[Warning], *rest: Any, **more: Any) -> None:
            if not issubclass(category, PluginWarning):
                others(message, category, *rest, **more)
            elif str(message) not in told:
                told.add(str(message))
                _tell(f"camcomp: warning: {shown(str(message))}")

        warnings.showwarning = show
        yield


def _report(error: CamcompError) -> int:
    color = sys.stderr.isatty() and not os.environ.get("NO_COLOR") and os.environ.get("TERM") != "dumb"
    _tell(format_error(error, color), color)
    if error.__cause__ is not None and os.environ.get("CAMCOMP_DEBUG"):
        import traceback

        traceback.print_exception(error.__cause__)
    return error.exit_code


def _tell(text: str, color: bool = False) -> None:
    """Write a text to standard error; failures to write are ignored, so that the exit code remains."""
    with suppress(OSError):
        click.echo(text, err=True, color=color)


def _bug(error: Exception) -> int:
    if os.environ.get("CAMCOMP_DEBUG"):
        import traceback

        traceback.print_exc()
    _tell(
        f"camcomp: internal error: {type(error).__name__}: {shown(str(error))}\n"
        f"  This is a bug in camcomp {__version__}, not a mistake in your files.\n"
        "  Run again with CAMCOMP_DEBUG=1 for the traceback, and report it with the files that show it."
    )
    return 70
