"""Errors that are meant for people: what happened, on which file, what to do."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager


class WalltopoError(Exception):
    """Base of every error that walltopo raises on purpose.

    Parameters
    ----------
    message : what happened, naming the file or the value.
    hint : what the reader can do about it (optional; shown on its own line).
    """

    exit_code = 1

    def __init__(self, message: str, hint: str = "") -> None:
        super().__init__(message)
        self.message = message
        self.hint = hint

    def __str__(self) -> str:
        return f"{self.message}\n{self.hint}" if self.hint else self.message


class SettingsError(WalltopoError):
    """A setting is unknown or its value is not allowed."""

    exit_code = 2


class InputError(WalltopoError):
    """What the user gave cannot be used: a missing file, a broken photo, too few photos."""

    exit_code = 3


class StageError(WalltopoError):
    """A stage could not produce its result from inputs that look right."""

    exit_code = 4


class EnvironmentLacksError(WalltopoError):
    """Something this machine lacks: a program, an extra, a GPU, disk space."""

    exit_code = 5


class BusyError(EnvironmentLacksError):
    """Another run is at work on the same scan."""


class EditsChangedError(InputError):
    """Other edits were saved since the version that these edits were made on."""


def problem_key(error: Exception) -> str:
    """Return the key by which a page states a problem in its own language; "" where none."""
    if isinstance(error, EditsChangedError):
        return "changed"
    if isinstance(error, BusyError):
        return "busy"
    return "lacks" if isinstance(error, EnvironmentLacksError) else ""


@contextmanager
def naming(where: object) -> Iterator[None]:
    """Begin the message of an `InputError` in the block with `where`: a file, an entry of one."""
    try:
        yield
    except InputError as error:
        raise InputError(f"{where}: {error.message}", error.hint) from error
