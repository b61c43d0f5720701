"""Read a clip in a child process with limits on time and memory."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Final

import msgspec

from walltopo.core import StageError
from walltopo.core.children import Child, child_process, python_module
from walltopo_gym.clips.reader import Fault, Found, Message, Phase, ReadRequest, Refused
from walltopo_gym.scans.running import WorkerStopsError, memory_mb_of

_LOOK_S: Final = 0.5


@dataclass(frozen=True)
class Limits:
    """Limits of one reading; `memory_mb` is 0 for none. `stopping`: the worker stops."""

    seconds: float
    memory_mb: float
    stopping: threading.Event


class WithdrawnError(Exception):
    """The clip was deleted while it was read."""


def read_in_child(
    request: ReadRequest, limits: Limits, report: Callable[[Phase], bool]
) -> Found | Refused:
    """Return what a clip shows, or why it cannot be read.

    Parameters
    ----------
    report : stores the present step; False: the clip is not wanted any more.

    Raises
    ------
    WithdrawnError : `report` returned False.
    WorkerStopsError : the worker stops.
    StageError : the process ended without an answer.
    """
    message = msgspec.json.encode(request) + b"\n"
    command = python_module("walltopo_gym.clips.reader")
    with (
        child_process(command, message, errors=None) as child,  # stderr is the operator's log
        _watch_limits(child, limits) as ended,
    ):
        for line in child.output:
            step = msgspec.json.decode(line, type=Message)
            if not isinstance(step, Phase):
                return step
            if not report(step):
                raise WithdrawnError
        code = child.wait()
    if limits.stopping.is_set():
        raise WorkerStopsError
    if ended:
        return Refused(ended[0])
    raise StageError(f"the reading of a clip ended with exit code {code}")


@contextmanager
def _watch_limits(child: Child, limits: Limits) -> Iterator[list[Fault]]:
    """Kill a process that exceeds a limit, during the block; the list then has the reason."""
    ended: list[Fault] = []
    is_over = threading.Event()
    deadline = time.monotonic() + limits.seconds

    def watch() -> None:
        while not is_over.wait(_LOOK_S):
            if limits.stopping.is_set():
                child.kill()
            elif time.monotonic() > deadline:
                ended.append("too-slow")
                child.kill()
            elif limits.memory_mb and memory_mb_of(child.pid) > limits.memory_mb:
                ended.append("too-large")
                child.kill()
            else:
                continue
            return

    watcher = threading.Thread(target=watch, name="clip-limits", daemon=True)
    watcher.start()
    try:
        yield ended
    finally:
        is_over.set()
        watcher.join()
