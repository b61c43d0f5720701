"""Child processes: start one, send it a message, read its lines, and never leave it behind."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO


class Child:
    """A running child process.

    Parameters
    ----------
    output : what it prints, line by line; ends when it does.
    """

    def __init__(self, process: subprocess.Popen[bytes]) -> None:
        assert process.stdout is not None
        self._process = process
        self.output: IO[bytes] = process.stdout

    def wait(self) -> int:
        """Wait for its end; return its exit code, negative for a signal."""
        return self._process.wait()


@contextmanager
def child_process(
    command: Sequence[str],
    message: bytes = b"",
    *,
    environment: Mapping[str, str] | None = None,
    errors: int | IO[bytes] = subprocess.DEVNULL,
    folder: Path | None = None,
) -> Iterator[Child]:
    """Run a command while the block is open; it is killed where it still runs at the end.

    The child has its own session, so that Ctrl-C reaches only this process. Its stdin stays open
    until the block ends: a child that calls `end_with_parent` ends with this process.

    Parameters
    ----------
    command : see `python_module` for one of our own.
    message : written to its stdin.
    environment : variables beside this process's own.
    errors : where its stderr goes, as in `subprocess.Popen`.
    folder : its working folder.
    """
    process = subprocess.Popen(
        command,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=errors,
        start_new_session=True,
        env={**os.environ, **(environment or {})},
        cwd=folder,
    )
    assert process.stdin is not None
    assert process.stdout is not None
    try:
        # A child that dies at once breaks the pipe; its output and exit code say why.
        with suppress(BrokenPipeError):
            process.stdin.write(message)
            process.stdin.flush()
        yield Child(process)
    finally:
        if process.poll() is None:
            process.kill()
            process.wait()
        process.stdout.close()
        with suppress(BrokenPipeError):
            process.stdin.close()


def python_module(name: str, *arguments: str) -> list[str]:
    """Return the command that runs a module by this Python."""
    return [sys.executable, "-m", name, *arguments]


def ending(code: int) -> str:
    """Return an exit code in words: `exit code 3`, `SIGKILL`."""
    if code >= 0:
        return f"exit code {code}"
    try:
        return signal.Signals(-code).name
    except ValueError:
        return f"signal {-code}"


def end_with_parent() -> None:
    """Let this process end when its stdin does, which its parent holds open.

    The message from the parent must have been read before.
    """
    threading.Thread(target=_wait_for_end, daemon=True).start()


def _wait_for_end() -> None:
    # Read the raw file: a thread blocked in a buffered reader holds its lock at interpreter exit.
    while os.read(0, 4096):
        pass
    os._exit(1)
