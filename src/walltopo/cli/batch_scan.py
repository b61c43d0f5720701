"""The process of one scan of a batch: a `Job` on stdin, its `Outcome` on stdout, a log.

    python -m walltopo.cli.batch_scan

The log is `scan.log` in the scan folder, from the moment when the folder is known to be one; each
run adds to it.
"""

from __future__ import annotations

import os
import sys
import time
import traceback
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec
from rich.console import Console

from walltopo.cli.scan_progress import ScanListener
from walltopo.core import BusyError, WalltopoError
from walltopo.core.children import end_with_parent
from walltopo.pipeline.batch.job import Job, Outcome, settings_of_job

if TYPE_CHECKING:
    from walltopo.pipeline.forecast import Forecast
    from walltopo.scans.manifest import StageRecord


LOG = "scan.log"
_WIDTH = 200
_PATIENCE_S = 30.0  # for the process of a lost worker to let go of the folder
_ASK_AGAIN_S = 0.5


class _Logged(ScanListener):
    """Writes what a terminal would show into the scan's log, native code's words included."""

    def __init__(self, folder: Path) -> None:
        # The words stand in the log as they are: no colours, no bar.
        console = Console(file=sys.stderr, width=_WIDTH, highlight=False, color_system=None)
        super().__init__(console, verbose=True)
        self._folder = folder
        self._begun: Forecast | None = None

    def scan_begins(self, forecast: Forecast) -> None:
        # Told once there is a log: before its first stage, the folder is not yet a scan's.
        self._begun = forecast

    def stage_begins(self, stage: str) -> None:
        self._open()
        super().stage_begins(stage)

    def stage_kept(self, stage: str, record: StageRecord) -> None:
        self._open()
        super().stage_kept(stage, record)

    def _open(self) -> None:
        if self._begun is None:
            return
        log = os.open(self._folder / LOG, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o644)
        os.dup2(log, 1)
        os.dup2(log, 2)
        os.close(log)
        now = datetime.now(UTC).isoformat(timespec="seconds")
        self._console.print(f"-- begun {now}, process {os.getpid()}")
        super().scan_begins(self._begun)
        self._begun = None


def main() -> int:
    """Scan, and say how it went; anything but 0 is a process that was lost."""
    job = msgspec.json.decode(sys.stdin.buffer.readline(), type=Job)
    end_with_parent()
    answer = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    try:
        outcome = _scanned(job)
    except WalltopoError as error:
        outcome = Outcome(out=job.out, state="failed", error=error.message, hint=error.hint)
    except MemoryError:
        error_text = "this machine's memory is too small for this input"
        outcome = Outcome(out=job.out, state="failed", error=error_text)
    except Exception as error:
        traceback.print_exc()
        outcome = Outcome(
            out=job.out,
            state="failed",
            error=f"defect in walltopo: {type(error).__name__}: {error}",
            hint=f"Report it with {Path(job.out) / LOG}",
        )
    if outcome.error:
        sys.stderr.write(f"error: {outcome.error}\n{outcome.hint}\n")
    sys.stderr.flush()
    with answer:
        answer.write(msgspec.json.encode(outcome))
    return 0


def _scanned(job: Job) -> Outcome:
    from walltopo.pipeline.runner import scan

    settings = settings_of_job(job)
    patient_until = time.monotonic() + _PATIENCE_S
    while True:
        try:
            with _Logged(Path(job.out)) as listener:
                result = scan([Path(p) for p in job.photos], job.out, settings, listener=listener)
            break
        except BusyError:
            if time.monotonic() > patient_until:
                raise
            time.sleep(_ASK_AGAIN_S)
    return Outcome(
        out=job.out,
        state="done" if result.ran else "up to date",
        ran=result.ran,
        photos=_count(result.metrics, "ingest", "photos"),
        holds=_count(result.metrics, "edit", "holds"),
        routes=_count(result.metrics, "edit", "routes"),
    )


def _count(metrics: dict[str, dict[str, Any]], stage: str, name: str) -> int:
    found = metrics.get(stage, {}).get(name, 0)
    return found if isinstance(found, int) else 0


if __name__ == "__main__":
    # Python waits at its end for no thread that reads.
    code = main()
    sys.stdout.flush()
    os._exit(code)
