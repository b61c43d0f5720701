"""Starting the process of one scan, and starting it again where it ends without a word.

Each scan has a process of its own: what native code makes of a bad photo, or the kernel of a full
memory, ends that scan alone. What it computed before stays in its folder, and the next try goes on
from there. The process ends with whoever started it.
"""

from __future__ import annotations

import time
from pathlib import Path

import msgspec

from walltopo.core import InputError
from walltopo.core.children import child_process, ending, python_module
from walltopo.pipeline.batch.job import Job, Outcome

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
    return Outcome(
        out=job.out,
        state="lost",
        tries=tries,
        seconds=round(time.monotonic() - begun, 2),
        error=f"its process ended with {ending(code)}, {tries} times",
        hint=f"Its last words may stand in {Path(job.out) / 'scan.log'}; fewer scans at a time "
        "need less memory.",
    )


def _run_once(job: Job, threads: int) -> tuple[int, bytes]:
    """Exit code and answer of the process."""
    names = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS") if threads else ()
    environment = dict.fromkeys(names, str(threads))
    message = msgspec.json.encode(job) + b"\n"
    # Its stderr goes nowhere until it has its log.
    with child_process(python_module(_MODULE), message, environment=environment) as child:
        answer = child.output.read()
        return child.wait(), answer
