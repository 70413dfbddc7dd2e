"""Dialect of programs that the command line states with precedence over machine files."""

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

from camcomp.ground import shelf
from camcomp.model.config.spec import Config

_DIALECT: ContextVar[str | None] = ContextVar("dialect", default=None)


@contextmanager
def stated_dialect(name: str) -> Iterator[None]:
    """Context in which programs are read in this dialect, with precedence over machine files. Raises ConfigError CC213."""
    shelf.load("dialects", name)
    token = _DIALECT.set(name)
    try:
        yield
    finally:
        _DIALECT.reset(token)


def dialect_without_config() -> str | None:
    """Dialect for programs without a machine file; None: detected from the text."""
    return _DIALECT.get()


def in_stated_dialect(config: Config) -> Config:
    """The configuration with the dialect of the command line, if there is one."""
    name = _DIALECT.get()
    if name is None:
        return config
    return config.model_copy(update={"control": config.control.model_copy(update={"dialect": name})})
