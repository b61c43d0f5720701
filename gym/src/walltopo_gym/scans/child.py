"""The scanning process: `python -m walltopo_gym.scans.child`.

It runs native code on untrusted photos, so a crash here costs one scan only. It ends when its
parent does, so that a scan never runs twice at once.
"""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path

import msgspec

from walltopo.core import WalltopoError
from walltopo.core.children import end_with_parent
from walltopo.pipeline.forecast import Forecast
from walltopo.pipeline.runner import scan
from walltopo.pipeline.settings import load_settings
from walltopo.scans.manifest import StageRecord
from walltopo_gym.errors import without_folders
from walltopo_gym.log_lines import traceback_of
from walltopo_gym.scans.job import Advanced, Ended, Failed, Job, Noted, ProcessMessage, Step

_AT_LEAST_S = 0.2  # between two lines that only count


class _Teller:
    """Forwards the pipeline's progress to the parent."""

    def __init__(self, out: int) -> None:
        self._out = os.fdopen(out, "wb", buffering=0)
        self._stage, self._count, self._reported_at = "", 0, 0.0

    def say(self, what: ProcessMessage) -> None:
        self._out.write(msgspec.json.encode(what) + b"\n")

    def step(self, what: str, total: int | None = None) -> None:
        self._count = 0
        self.say(Step(self._stage, what, total))

    def advance(self, count: int = 1) -> None:
        self._count += count
        if time.monotonic() - self._reported_at >= _AT_LEAST_S:
            self.say(Advanced(self._count))
            self._count, self._reported_at = 0, time.monotonic()

    def note(self, message: str) -> None:
        self.say(Noted(message))

    def detail(self, message: str) -> None: ...

    def scan_begins(self, forecast: Forecast) -> None: ...

    def stage_begins(self, stage: str) -> None:
        self._stage = stage
        self.step("starting")

    def stage_ends(self, stage: str, record: StageRecord) -> None:
        if record.state == "done":
            self.say(Ended(stage))

    def stage_kept(self, stage: str, record: StageRecord) -> None:
        self.say(Ended(stage))


def main() -> None:
    """Read one job from stdin and write messages to stdout; end when stdin ends."""
    teller = _Teller(os.dup(1))
    os.dup2(2, 1)  # what libraries print goes to the operator's log
    job = msgspec.json.decode(sys.stdin.buffer.readline(), type=Job)
    end_with_parent()
    try:
        config = Path(job.config) if job.config else None
        scan(job.photos, job.out, load_settings(config, job.settings), listener=teller)
    except WalltopoError as error:
        message, hint = without_folders(error.message), without_folders(error.hint)
        teller.say(Failed(message, hint, defect=False))
    except Exception as error:
        sys.stderr.write(traceback_of(error) + "\n")
        teller.say(Failed(f"{type(error).__name__}: {error}", "", defect=True))


if __name__ == "__main__":
    main()
