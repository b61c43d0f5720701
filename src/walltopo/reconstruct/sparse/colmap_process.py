"""Running COLMAP in a child process: progress from its log, errors as errors, Ctrl-C safe."""

from __future__ import annotations

import json
import re
import subprocess
from collections import deque
from typing import Any

import msgspec

from walltopo.core import Progress, StageError
from walltopo.core.children import child_process, python_module
from walltopo.reconstruct.sparse.jobs import Job, Mapped

_EVENT = "@walltopo "
_WHAT = {
    "features": "find features",
    "matches": "match photos",
    "learned": "look again with a network",
    "learned matches": "match again with a network",
    "register": "register photos",
    "refine": "refine all together",
}
_FEATURE = re.compile(r"Processed file \[\d+/\d+\]")
_BLOCK = re.compile(r"\] Processing block \[")
_BLOCK_DONE = re.compile(r"\] in [\d.]+s")
_REGISTER = re.compile(r"Registering (initial image pair|image) #\d+")
_GLOG = re.compile(r"^[IWEF]\d{8} [\d:.]+ +\d+ [\w.]+:\d+\] ?")


def run_worker(job: Job, progress: Progress) -> Mapped:
    """Run one job of `colmap_worker`; what it mapped (nothing, where it only found features).

    Raises
    ------
    StageError : COLMAP failed or ended; carries the last lines of its log.
    """
    # COLMAP has threads of its own; BLAS on several would also make the last bits differ.
    environment = {"PYTHONUNBUFFERED": "1", "OPENBLAS_NUM_THREADS": "1"}
    if job.threads > 0:
        environment["OMP_NUM_THREADS"] = str(job.threads)
    listener = _Listener(progress)
    with child_process(
        python_module("walltopo.reconstruct.sparse.colmap_worker"),
        msgspec.json.encode(job) + b"\n",
        environment=environment,
        errors=subprocess.STDOUT,
    ) as child:
        for line in child.output:
            listener.hear(line.decode("utf-8", "replace").rstrip("\n"))
        code = child.wait()
    listener.check(code)
    return msgspec.convert(listener.result, Mapped)


class _Listener:
    """Turns the child's lines into progress."""

    def __init__(self, progress: Progress) -> None:
        self.progress = progress
        self.result: dict[str, Any] = {}
        self.error = ""
        self._tail: deque[str] = deque(maxlen=8)
        self._step = ""
        self._left = 0
        self._block = 0

    def hear(self, line: str) -> None:
        if line.startswith(_EVENT):
            self._event(json.loads(line[len(_EVENT) :]))
            return
        text = _GLOG.sub("", line).strip()
        if not text:
            return
        self._tail.append(text)
        self.progress.detail(f"colmap: {text}")
        if self._step == "features" and _FEATURE.search(text):
            self._advance(1)
        elif self._step == "matches" and _BLOCK_DONE.search(line):
            self._advance(self._block)
        elif self._step == "register" and (found := _REGISTER.search(text)):
            self._advance(2 if found.group(1).startswith("initial") else 1)

    def check(self, code: int) -> None:
        if code == 0 and not self.error:
            return
        told = self.error or "\n".join(self._tail)
        ended = f"ended by signal {-code}" if code < 0 else f"failed (exit code {code})"
        raise StageError(
            f"COLMAP {ended} while it should {_WHAT.get(self._step, 'start')}:\n{told}",
            "Run again with -v to see its whole log.",
        )

    def _event(self, event: dict[str, Any]) -> None:
        if "step" in event:
            self._step = event["step"]
            self._left = event["total"]
            self._block = event.get("block", 1)
            if self._left:
                self.progress.step(_WHAT[self._step], self._left)
        elif "advance" in event:
            self._advance(event["advance"])
        elif "error" in event:
            self.error = event["error"]
        else:
            if self._step == "refine":
                self._advance(1)
            self.result.update(event)

    def _advance(self, count: int) -> None:
        # Tries are logged, not successes: never count beyond what was announced.
        count = min(count, self._left)
        self._left -= count
        if count:
            self.progress.advance(count)
