"""Define the errors that users see: what happened, on which file, what to do."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager


class WalltopoError(Exception):
    """The base class of all errors that walltopo raises on purpose.

    Parameters
    ----------
    message : what happened; names the file or the value.
    hint : what the user can do (optional; shown on its own line).
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
    """The user's input cannot be used: a missing file, a broken photo, too few photos."""

    exit_code = 3

    def prefixed(self, where: object) -> InputError:
        """Return this error with `where` before its message."""
        return InputError(f"{where}: {self.message}", self.hint)


class StageError(WalltopoError):
    """A stage failed although its inputs look valid."""

    exit_code = 4


class EnvironmentLacksError(WalltopoError):
    """This machine lacks something: a program, an extra, a GPU, disk space."""

    exit_code = 5


class BusyError(EnvironmentLacksError):
    """Another run holds the lock of the same scan."""


class EditsChangedError(InputError):
    """Other edits were saved after the version that these edits are based on."""


def problem_key(error: Exception) -> str:
    """Return the translation key of a problem, or "" if it has none."""
    if isinstance(error, EditsChangedError):
        return "changed"
    if isinstance(error, BusyError):
        return "busy"
    return "lacks" if isinstance(error, EnvironmentLacksError) else ""


@contextmanager
def prefix_errors(where: object) -> Iterator[None]:
    """Prefix the message of an `InputError` in the block with `where`: a file or an entry."""
    try:
        yield
    except InputError as error:
        raise error.prefixed(where) from error
