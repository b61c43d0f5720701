"""Run a scan whose photos or folder are in an object store: download, run, upload.

Files that the scan removed are deleted from the store after all uploads.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING

from msgspec.structs import replace

from walltopo.core import InputError, WalltopoError
from walltopo.core.files import files_below
from walltopo.pipeline.batch.job import Outcome, ScanJob, run_job
from walltopo.pipeline.batch.job_list import is_url
from walltopo.scans.object_store import fetch_missing, open_store, send_files

if TYPE_CHECKING:  # an optional package
    from obstore.store import ObjectStore


def run_anywhere(job: ScanJob, threads: int = 0) -> Outcome:
    """Run a job whose photos and scan folder may be URLs; return errors as an outcome."""
    try:
        with _local_copy(job) as local_job:
            outcome = run_job(local_job, threads)
    except WalltopoError as error:
        return Outcome(out=job.out, state="failed", error=error.message, hint=error.hint)
    except Exception as error:  # each object store raises its own classes
        cause = f"{type(error).__name__}: {error}"
        return Outcome(out=job.out, state="failed", error=f"{job.out}: cannot be copied ({cause})")
    return replace(outcome, out=job.out)


@contextmanager
def _local_copy(job: ScanJob) -> Iterator[ScanJob]:
    """Download the job's files and yield a job with local paths; upload results, also on
    failure."""
    urls = [place for place in (*job.photos, job.out) if is_url(place)]
    if not urls:
        yield job
        return
    with tempfile.TemporaryDirectory(prefix="walltopo-batch-") as temporary:
        photos, out = Path(temporary) / "photos", Path(temporary) / PurePosixPath(job.out).name
        if is_url(job.photos[0]):
            if not fetch_missing(open_store(job.photos[0]), photos):
                raise InputError(f"{job.photos[0]}: no photos there")
            job = replace(job, photos=(str(photos),))
        if not is_url(job.out):
            yield job
            return
        store = open_store(job.out)
        fetch_missing(store, out)
        before = _file_stats(out)
        yield replace(job, out=str(out))
        _upload_changes(store, out, before)


def _file_stats(folder: Path) -> dict[str, tuple[int, int]]:
    """Return size and modification time of each file of a folder, by its key."""
    if not folder.is_dir():
        return {}
    stats = {p.relative_to(folder).as_posix(): p.stat() for p in files_below(folder)}
    return {key: (stat.st_size, stat.st_mtime_ns) for key, stat in stats.items()}


def _upload_changes(store: ObjectStore, folder: Path, before: dict[str, tuple[int, int]]) -> None:
    """Upload changed files, then delete removed ones."""
    import obstore

    now = _file_stats(folder)
    changed = (folder / key for key, stats_now in now.items() if before.get(key) != stats_now)
    send_files(store, folder, changed)
    for key in sorted(set(before) - set(now)):
        obstore.delete(store, key)
