"""Run one scan of a batch in a child process."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Literal

import msgspec

from walltopo.core import InputError
from walltopo.core.children import child_process, describe_exit, python_module
from walltopo.core.parallel import library_threads
from walltopo.pipeline.settings import Settings, load_settings

State = Literal["done", "up to date", "failed", "lost"]


class ScanJob(msgspec.Struct, frozen=True, kw_only=True):
    """A request for one scan.

    Parameters
    ----------
    photos : absolute paths of folders, photos or videos, or one URL of an object store.
    out : scan folder, or its URL.
    reference : scan to align to, or "".
    config : settings file, or "".
    settings : `section.key=value` texts that override the file.
    """

    photos: tuple[str, ...]
    out: str
    reference: str = ""
    config: str = ""
    settings: tuple[str, ...] = ()


class Outcome(msgspec.Struct, frozen=True, kw_only=True):
    """The result of a scan.

    Parameters
    ----------
    state : "up to date" if no stage had to run; "failed" if walltopo raised an error; "lost" if the
        process crashed at every try.
    tries : number of starts.
    ran : stages that were computed.
    photos, holds, routes : numbers of each.
    error : what happened.
    hint : what to do.
    """

    out: str
    state: State
    seconds: float = 0.0
    tries: int = 1
    ran: tuple[str, ...] = ()
    photos: int = 0
    holds: int = 0
    routes: int = 0
    error: str = ""
    hint: str = ""

    @property
    def is_finished(self) -> bool:
        """Return whether the scan is finished."""
        return self.state in ("done", "up to date")


def settings_of_job(job: ScanJob) -> Settings:
    """Return the settings of a job.

    Raises
    ------
    SettingsError : a setting is unknown or invalid.
    InputError : the settings file cannot be read.
    """
    given = list(job.settings)
    if job.reference:
        # A JSON string is a valid TOML string.
        given.insert(0, f"sparse.reference={json.dumps(job.reference, ensure_ascii=False)}")
    return load_settings(Path(job.config) if job.config else None, given)


TRIES = 3
# Run by name, because this package must not import the command line that formats the log.
_MODULE = "walltopo.cli.batch_scan"


def run_job(job: ScanJob, threads: int = 0, tries: int = TRIES) -> Outcome:
    """Run one scan in a child process; retry if the process crashes.

    Parameters
    ----------
    job : job with local paths, no URLs.
    threads : threads of numerical libraries; 0: their default.
    tries : maximum number of starts.
    """
    started = time.monotonic()
    code, reply = 0, b""
    for number in range(1, tries + 1):
        code, reply = _run_once(job, threads)
        if code == 0:
            try:
                outcome = msgspec.json.decode(reply, type=Outcome)
            except msgspec.DecodeError as error:
                raise InputError(
                    f"{job.out}: its process sent an invalid reply: {error}"
                ) from error
            seconds = round(time.monotonic() - started, 2)
            return msgspec.structs.replace(outcome, tries=number, seconds=seconds)
    return Outcome(
        out=job.out,
        state="lost",
        tries=tries,
        seconds=round(time.monotonic() - started, 2),
        error=f"its process ended with {describe_exit(code)}, {tries} times",
        hint=f"See {Path(job.out) / 'scan.log'}. Running fewer scans at a time needs less memory.",
    )


def _run_once(job: ScanJob, threads: int) -> tuple[int, bytes]:
    """Run the process once; return its exit code and its reply."""
    environment = library_threads(threads)
    message = msgspec.json.encode(job) + b"\n"
    # The child process opens its log itself; stderr is discarded until then.
    with child_process(python_module(_MODULE), message, environment=environment) as child:
        reply = child.output.read()
        return child.wait(), reply
