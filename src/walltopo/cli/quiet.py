"""The output streams of a command for `-v` and `-q`. Imports only what does not delay a start."""

from __future__ import annotations

import io
import logging
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager


def show_unprintable() -> None:
    """Print escape codes for characters that the terminal's encoding lacks, instead of failing."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


@contextmanager
def quiet_libraries(verbose: bool) -> Iterator[None]:
    """Hide Python warnings and log lines of libraries during the block, unless `verbose`.

    Python's own `-W` and `PYTHONWARNINGS` stay in force.
    """
    root, handler = logging.getLogger(), logging.NullHandler()
    with warnings.catch_warnings():
        if verbose:
            warnings.showwarning = _show
        else:
            if not sys.warnoptions:
                warnings.simplefilter("ignore")
            root.addHandler(handler)  # without any handler, logging writes to stderr
        try:
            yield
        finally:
            root.removeHandler(handler)


def _show(
    message: Warning | str,
    category: type[Warning],
    filename: str,
    lineno: int,
    file: object = None,
    line: str | None = None,
) -> None:
    from walltopo.cli.console import error_console

    where = f"{filename}:{lineno}"
    error_console.print(f"{where}: {category.__name__}: {message}", style="dim", soft_wrap=True)


@contextmanager
def quiet_console(quiet: bool) -> Iterator[None]:
    """Print only errors during the block, if `quiet`."""
    if not quiet:
        yield
        return
    from walltopo.cli.console import console

    before, console.quiet = console.quiet, True
    try:
        yield
    finally:
        console.quiet = before
