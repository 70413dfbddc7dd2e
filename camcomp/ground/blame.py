"""Errors of users' plug-ins: exceptions in their code become ConfigError with its location, not reports of a bug."""

import linecache
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from camcomp.ground.errors import CamcompError, ConfigError, Location, Terminated

_PACKAGE = str(Path(__file__).parent.parent)


@contextmanager
def blamed(who: str) -> Iterator[None]:
    """Convert exceptions inside the block to ConfigError CC281 about `who`; errors of camcomp itself pass unchanged."""
    try:
        yield
    except (CamcompError, KeyboardInterrupt, Terminated, GeneratorExit):
        raise
    except BaseException as error:
        what = f"{type(error).__name__}: {error}".rstrip(": ")
        raise ConfigError("CC281", f"{who} raised {what}", at=place_of(error)) from error


def place_of(error: BaseException) -> Location | None:
    """Location of an error in foreign code: the innermost line of the first file outside of camcomp in its traceback."""
    if isinstance(error, SyntaxError) and error.filename and error.lineno:
        return Location(error.filename, error.lineno, max(error.offset or 1, 1), error.text or "")
    frames = [(each.filename, each.lineno or 1) for each in traceback.extract_tb(error.__traceback__)]
    theirs = [each for each in frames if not _is_machinery(each[0])]
    if not theirs:
        return None
    file, line = [each for each in theirs if each[0] == theirs[0][0]][-1]
    source = linecache.getline(file, line)
    return Location(file, line, len(source) - len(source.lstrip()) + 1, source)


def _is_machinery(file: str) -> bool:
    """Whether a file belongs to the import machinery between camcomp and a plug-in."""
    return file.startswith(("<frozen", _PACKAGE)) or "importlib" in Path(file).parts or file.endswith("contextlib.py")
