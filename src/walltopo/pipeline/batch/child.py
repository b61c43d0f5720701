"""Starting the process of one scan, and starting it again where it ends without a word.

Each scan has a process of its own: what native code makes of a bad photo, or the kernel of a full
memory, ends that scan alone. What it computed before stays in its folder, and the next try goes on
from there. The process ends with whoever started it.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import msgspec

from walltopo.core import InputError
from walltopo.pipeline.batch.job import Job, Outcome

__all__ = ["TRIES", "run_job"]

TRIES = 3
# Run by its name: a floor above, where the words for the log are.
_MODULE = "walltopo.cli.batch_scan"


def run_job(job: Job, threads: int = 0, tries: int = TRIES) -> Outcome:
    """Run one scan to its end.

    Parameters
    ----------
    job : with places of this machine, no URL.
    threads : of its libraries; 0 takes what they take.
    tries : how often it is begun where its process is lost.
    """
    begun = time.monotonic()
    code, told = 0, b""
    for number in range(1, tries + 1):
        code, told = _run_once(job, threads)
        if code == 0:
            try:
                outcome = msgspec.json.decode(told, type=Outcome)
            except msgspec.DecodeError as error:
                raise InputError(
                    f"{job.out}: its process answered what is none: {error}"
                ) from error
            seconds = round(time.monotonic() - begun, 2)
            return msgspec.structs.replace(outcome, tries=number, seconds=seconds)
    how = f"by signal {-code}" if code < 0 else f"with exit code {code}"
    return Outcome(
        out=job.out,
        state="lost",
        tries=tries,
        seconds=round(time.monotonic() - begun, 2),
        error=f"its process ended {how}, {tries} times",
        hint=f"Its last words may stand in {Path(job.out) / 'scan.log'}; fewer scans at a time "
        "need less memory.",
    )


def _run_once(job: Job, threads: int) -> tuple[int, bytes]:
    """Exit code and answer of the process."""
    environment = dict(os.environ)
    if threads:
        for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS"):
            environment[name] = str(threads)
    child = subprocess.Popen(
        [sys.executable, "-m", _MODULE],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,  # until it has its log
        start_new_session=True,
        env=environment,
    )
    assert child.stdin is not None
    assert child.stdout is not None
    try:
        with suppress(BrokenPipeError):
            child.stdin.write(msgspec.json.encode(job) + b"\n")
            child.stdin.flush()
        told = child.stdout.read()
        return child.wait(), told
    finally:
        if child.poll() is None:
            child.kill()
            child.wait()
        child.stdout.close()
        with suppress(BrokenPipeError):
            child.stdin.close()
