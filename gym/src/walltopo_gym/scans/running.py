"""One scan in a watched child process."""

from __future__ import annotations

import threading
from collections import deque
from contextlib import ExitStack, suppress

import msgspec
import psutil

from walltopo.core.children import child_process, python_module
from walltopo_gym.scans.job import Advanced, Ended, Failed, Job, Noted, ProcessMessage, Step

_MAX_NOTES = 50


class WorkerStopsError(BaseException):
    """The worker abandons a job in the middle, which then has no result.

    It is not an `Exception`, because DBOS stores those as the step's result. The workflow stays as
    it is and resumes when a worker is there again.
    """


def memory_mb_of(pid: int) -> float:
    """Return the memory of a process and its children in MB; shared memory counts twice."""
    held = 0.0
    with suppress(psutil.Error):
        child = psutil.Process(pid)
        for process in (child, *child.children(recursive=True)):
            with suppress(psutil.Error):  # it has just ended
                held += process.memory_info().rss / 1e6
    return held


class RunningScan:
    """A scanning child process; `news` is notified at each message and at its end.

    Parameters
    ----------
    job : its task.
    """

    def __init__(self, job: Job) -> None:
        self.news = threading.Condition()
        self.step = Step("", "starting", None)
        self.done = 0
        self.notes: deque[str] = deque(maxlen=_MAX_NOTES)
        self.ended: list[str] = []
        self.failure: Failed | None = None
        self.exit: int | None = None
        self._ending = ExitStack()
        command, message = python_module("walltopo_gym.scans.child"), msgspec.json.encode(job)
        self._child = self._ending.enter_context(
            child_process(command, message + b"\n", errors=None)
        )
        self._listener = threading.Thread(target=self._listen, daemon=True)
        self._listener.start()

    def memory_mb(self) -> float:
        """Return the memory of the process and its children in MB; shared memory counts twice."""
        return memory_mb_of(self._child.pid)

    def stop(self) -> None:
        """Kill the process and its children, if it has not ended."""
        self._child.kill()
        self._listener.join()
        self._ending.close()

    def _listen(self) -> None:
        for line in self._child.output:
            message = msgspec.json.decode(line, type=ProcessMessage)
            with self.news:
                self._take(message)
                self.news.notify_all()
        code = self._child.wait()
        with self.news:
            self.exit = code
            self.news.notify_all()

    def _take(self, message: ProcessMessage) -> None:
        if isinstance(message, Step):
            self.step, self.done = message, 0
        elif isinstance(message, Advanced):
            self.done += message.count
        elif isinstance(message, Noted):
            self.notes.append(message.text)
        elif isinstance(message, Ended):
            self.ended.append(message.stage)
        else:
            self.failure = message
