"""One scan in a child process, watched: how far it is, whether it shall go on."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
from collections import deque
from contextlib import suppress

import msgspec
import psutil

from walltopo_gym.scans.job import Advanced, Ended, Failed, Job, Noted, Said, Step

_MOST_NOTES = 50


class RunningScan:
    """A child that scans; `told` is notified whenever it says something, or ends.

    Parameters
    ----------
    job : what it is asked.
    """

    def __init__(self, job: Job) -> None:
        self.told = threading.Condition()
        self.step = Step("", "starting", None)
        self.done = 0
        self.notes: deque[str] = deque(maxlen=_MOST_NOTES)
        self.ended: list[str] = []
        self.failure: Failed | None = None
        self.exit: int | None = None
        self._child = subprocess.Popen(
            [sys.executable, "-m", "walltopo_gym.scans.child"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            start_new_session=True,  # with its own children it can be ended as one
        )
        assert self._child.stdin is not None
        with suppress(BrokenPipeError):
            self._child.stdin.write(msgspec.json.encode(job) + b"\n")
            self._child.stdin.flush()
        self._listener = threading.Thread(target=self._listen, daemon=True)
        self._listener.start()

    def memory_mb(self) -> float:
        """What it and its own children hold at this moment, in MB; what they share counts twice."""
        held = 0.0
        with suppress(psutil.Error):
            child = psutil.Process(self._child.pid)
            for process in (child, *child.children(recursive=True)):
                with suppress(psutil.Error):  # it has just ended
                    held += process.memory_info().rss / 1e6
        return held

    def stop(self) -> None:
        """End it, if it has not ended, with all that it started."""
        with suppress(ProcessLookupError):
            os.killpg(self._child.pid, signal.SIGKILL)
        self._child.wait()
        self._listener.join()
        assert self._child.stdin is not None
        with suppress(BrokenPipeError):
            self._child.stdin.close()

    def _listen(self) -> None:
        assert self._child.stdout is not None
        with self._child.stdout as lines:
            for line in lines:
                said = msgspec.json.decode(line, type=Said)
                with self.told:
                    self._take(said)
                    self.told.notify_all()
        code = self._child.wait()
        with self.told:
            self.exit = code
            self.told.notify_all()

    def _take(self, said: Said) -> None:
        if isinstance(said, Step):
            self.step, self.done = said, 0
        elif isinstance(said, Advanced):
            self.done += said.count
        elif isinstance(said, Noted):
            self.notes.append(said.text)
        elif isinstance(said, Ended):
            self.ended.append(said.stage)
        else:
            self.failure = said
