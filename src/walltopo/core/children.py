"""Run child processes: start, send a message, read output lines, always terminate."""

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

# Windows has no sessions: there a group of its own keeps Ctrl-C from the child.
_NEW_GROUP = 0
if sys.platform == "win32":
    _NEW_GROUP = subprocess.CREATE_NEW_PROCESS_GROUP


class Child:
    """A running child process.

    Parameters
    ----------
    output : standard output of the process; pid : its number.
    """

    def __init__(self, process: subprocess.Popen[bytes]) -> None:
        assert process.stdout is not None
        self._process = process
        self.output: IO[bytes] = process.stdout
        self.pid = process.pid

    @property
    def is_running(self) -> bool:
        """Whether the process has not ended."""
        return self._process.poll() is None

    def send(self, message: bytes) -> None:
        """Write a message to the process's stdin; one that has ended gets nothing."""
        assert self._process.stdin is not None
        with suppress(BrokenPipeError):
            self._process.stdin.write(message)
            self._process.stdin.flush()

    def kill(self) -> None:
        """Kill the process if it is running, and with it what it started in its session.

        Windows has no sessions; there what it started goes on.
        """
        if self._process.poll() is None:
            if sys.platform == "win32":
                self._process.kill()
            else:
                with suppress(ProcessLookupError):
                    os.killpg(self.pid, signal.SIGKILL)
            self._process.wait()

    def wait(self) -> int:
        """Wait for the process to exit; return its exit code, negative for a signal."""
        return self._process.wait()


@contextmanager
def child_process(
    command: Sequence[str],
    message: bytes = b"",
    *,
    environment: Mapping[str, str] | None = None,
    errors: int | IO[bytes] | None = subprocess.DEVNULL,
    folder: Path | None = None,
) -> Iterator[Child]:
    """Run a command during the block; kill it if it is still running at the end.

    The child has its own session, so Ctrl-C reaches only this process. Its stdin stays open until
    the block ends, so a child that calls `end_with_parent` exits with this process.

    Parameters
    ----------
    command : program and arguments; see `python_module`.
    message : bytes written to stdin.
    environment : variables added to those of this process.
    errors : destination of stderr, as in `subprocess.Popen`; None: that of this process.
    folder : working folder.
    """
    process = subprocess.Popen(
        command,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=errors,
        start_new_session=True,
        creationflags=_NEW_GROUP,
        env={**os.environ, **(environment or {})},
        cwd=folder,
    )
    assert process.stdin is not None
    child = Child(process)
    try:
        # A child that exits at once breaks the pipe; its output and exit code tell why.
        child.send(message)
        yield child
    finally:
        child.kill()
        child.output.close()
        with suppress(BrokenPipeError):
            process.stdin.close()


def python_module(name: str, *arguments: str) -> list[str]:
    """Return the command that runs a module with this Python interpreter."""
    return [sys.executable, "-m", name, *arguments]


def describe_exit(code: int) -> str:
    """Return an exit code in words: `exit code 3`, `SIGKILL`."""
    if code >= 0:
        return f"exit code {code}"
    try:
        return signal.Signals(-code).name
    except ValueError:
        return f"signal {-code}"


def end_with_parent() -> None:
    """Exit this process when its stdin closes, which its parent keeps open.

    Call it after the parent's message has been read.
    """
    threading.Thread(target=_exit_at_eof, daemon=True).start()


def _exit_at_eof() -> None:
    # Read the raw file: a thread blocked in a buffered reader holds its lock at interpreter exit.
    while os.read(0, 4096):
        pass
    os._exit(1)
