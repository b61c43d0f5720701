"""Scans whose photos or folders lie in a store of objects: copied to the worker and back.

Nothing in the store is ever half a file. `scan.json`, which says that a scan is there and what
each of its files must be, is written last; what the scan no longer has is deleted after it.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path, PurePosixPath
from typing import Any

from msgspec.structs import replace

from walltopo.core import EnvironmentLacksError, InputError, WalltopoError
from walltopo.core.files import atomic_path, files_below, join_inside
from walltopo.pipeline.batch.child import run_job
from walltopo.pipeline.batch.job import Job, Outcome
from walltopo.pipeline.batch.listed import is_url
from walltopo.scans.folder import ScanFolder

_CHUNK = 1 << 20


def run_anywhere(job: Job, threads: int = 0) -> Outcome:
    """As `run_job`, where photos and scan folder may be URLs; every error is an outcome."""
    try:
        with _copied(job) as here:
            outcome = run_job(here, threads)
    except WalltopoError as error:
        return Outcome(out=job.out, state="failed", error=error.message, hint=error.hint)
    except Exception as error:  # each kind of store raises classes of its own
        told = f"{type(error).__name__}: {error}"
        return Outcome(out=job.out, state="failed", error=f"{job.out}: cannot be copied ({told})")
    return replace(outcome, out=job.out)


@contextmanager
def _copied(job: Job) -> Iterator[Job]:
    """The job with places of this machine; what it made goes back to its URL, also on a failure."""
    urls = [place for place in (*job.photos, job.out) if is_url(place)]
    if not urls:
        yield job
        return
    with tempfile.TemporaryDirectory(prefix="walltopo-batch-") as made:
        photos, out = Path(made) / "photos", Path(made) / PurePosixPath(job.out).name
        if is_url(job.photos[0]):
            if not _fetch(_opened(job.photos[0]), photos):
                raise InputError(f"{job.photos[0]}: no photos there")
            job = replace(job, photos=(str(photos),))
        if not is_url(job.out):
            yield job
            return
        store = _opened(job.out)
        _fetch(store, out)
        before = _seen(out)
        yield replace(job, out=str(out))
        _give_back(store, out, before)


def _opened(url: str) -> Any:
    """The store behind a URL."""
    try:
        from obstore.store import from_url
    except ImportError as error:
        raise EnvironmentLacksError(
            f"{url} needs obstore, which is not installed here", "pip install 'walltopo[s3]'"
        ) from error
    try:
        return from_url(url)
    except Exception as error:  # a class for each kind of store
        raise InputError(f"{url}: no store that is understood ({error})") from error


def _fetch(store: Any, folder: Path) -> int:
    """Copy all that a store has; how many files that were."""
    import obstore

    keys = [str(item["path"]) for page in obstore.list(store) for item in page]
    for key in keys:
        path = join_inside(folder, key)
        path.parent.mkdir(parents=True, exist_ok=True)
        with atomic_path(path) as temporary, temporary.open("wb") as stream:
            for piece in obstore.get(store, key).stream(min_chunk_size=_CHUNK):
                stream.write(bytes(piece))
    return len(keys)


def _seen(folder: Path) -> dict[str, tuple[int, int]]:
    """Size and time of each file of a folder, by its key."""
    if not folder.is_dir():
        return {}
    stats = {p.relative_to(folder).as_posix(): p.stat() for p in files_below(folder)}
    return {key: (stat.st_size, stat.st_mtime_ns) for key, stat in stats.items()}


def _give_back(store: Any, folder: Path, before: dict[str, tuple[int, int]]) -> None:
    """Write what changed, the manifest last; then delete what is gone."""
    import obstore

    now = _seen(folder)
    manifest = ScanFolder(folder).manifest.name
    changed = [key for key, seen in now.items() if before.get(key) != seen]
    for key in sorted(changed, key=lambda key: (key == manifest, key)):
        obstore.put(store, key, folder / key)
    for key in sorted(set(before) - set(now)):
        obstore.delete(store, key)
