"""The process of one scan of a batch: reads a `ScanJob` on stdin, writes an `Outcome` to stdout.

    python -m walltopo.cli.batch_scan

The log is `scan.log` in the scan folder, from the first stage on; each run appends to it.
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
from walltopo.pipeline.batch.job import Outcome, ScanJob, settings_of_job

if TYPE_CHECKING:
    from walltopo.pipeline.forecast import Forecast
    from walltopo.scans.manifest import StageRecord


LOG = "scan.log"
_WIDTH = 200
_BUSY_TIMEOUT_S = 30.0  # for the process of a lost worker to release the folder
_RETRY_S = 0.5


class _LogListener(ScanListener):
    """Writes a scan's terminal output, including that of native code, into the scan's log."""

    def __init__(self, folder: Path) -> None:
        # Plain text for the log: no colours, no bar.
        console = Console(file=sys.stderr, width=_WIDTH, highlight=False, color_system=None)
        super().__init__(console, verbose=True)
        self._folder = folder
        self._forecast_to_print: Forecast | None = None

    def scan_begins(self, forecast: Forecast) -> None:
        # Print this later: before its first stage, the folder is not yet a scan folder.
        self._forecast_to_print = forecast

    def stage_begins(self, stage: str) -> None:
        self._open()
        super().stage_begins(stage)

    def stage_kept(self, stage: str, record: StageRecord) -> None:
        self._open()
        super().stage_kept(stage, record)

    def _open(self) -> None:
        if self._forecast_to_print is None:
            return
        log = os.open(self._folder / LOG, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o644)
        os.dup2(log, 1)
        os.dup2(log, 2)
        os.close(log)
        now = datetime.now(UTC).isoformat(timespec="seconds")
        self._console.print(f"-- started {now}, process {os.getpid()}")
        super().scan_begins(self._forecast_to_print)
        self._forecast_to_print = None


def main() -> int:
    """Run the scan and write its outcome; another exit code than 0 means a lost process."""
    job = msgspec.json.decode(sys.stdin.buffer.readline(), type=ScanJob)
    end_with_parent()
    output = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    try:
        outcome = _run(job)
    except WalltopoError as error:
        outcome = Outcome(out=job.out, state="failed", error=error.message, hint=error.hint)
    except MemoryError:
        error_text = "this machine does not have enough memory for this input"
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
    with output:
        output.write(msgspec.json.encode(outcome))
    return 0


def _run(job: ScanJob) -> Outcome:
    from walltopo.pipeline.runner import scan

    settings = settings_of_job(job)
    deadline = time.monotonic() + _BUSY_TIMEOUT_S
    while True:
        try:
            with _LogListener(Path(job.out)) as listener:
                result = scan([Path(p) for p in job.photos], job.out, settings, listener=listener)
            break
        except BusyError:
            if time.monotonic() > deadline:
                raise
            time.sleep(_RETRY_S)
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
    # Exit without waiting: at interpreter exit, Python would wait for threads that read.
    code = main()
    sys.stdout.flush()
    os._exit(code)
