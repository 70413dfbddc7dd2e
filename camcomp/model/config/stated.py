"""What a command line states over every machine file that the command reads: the dialect of programs."""

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

from camcomp.ground import shelf
from camcomp.model.config.spec import Config

_DIALECT: ContextVar[str | None] = ContextVar("dialect", default=None)


@contextmanager
def stated_dialect(name: str) -> Iterator[None]:
    """Within it programs are read in this dialect, whatever machine files say. Raises ConfigError CC213 for an unknown one."""
    shelf.load("dialects", name)
    token = _DIALECT.set(name)
    try:
        yield
    finally:
        _DIALECT.reset(token)


def dialect_without_config() -> str | None:
    """Dialect in which programs are read without a machine file; None: the one that they look like."""
    return _DIALECT.get()


def in_stated_dialect(config: Config) -> Config:
    """The configuration with the dialect of the command line, where that names one."""
    name = _DIALECT.get()
    if name is None:
        return config
    return config.model_copy(update={"control": config.control.model_copy(update={"dialect": name})})
