"""The feature database in `work/`: kept while it fits its photos and settings and is undamaged.

A killed run continues with the photos and pairs that are missing; an update into a reference takes
over what the reference's scan found. `made-from.json` beside it says what it was made from and,
once it is complete, what its content is.
"""

from __future__ import annotations

import shutil
import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Any

import msgspec

from walltopo.core import InputError, Progress
from walltopo.core.files import hash_path, read_json, write_json
from walltopo.reconstruct.sparse.colmap_process import run_worker
from walltopo.reconstruct.sparse.jobs import Job

_STAMP = "made-from.json"
_CONTENT = "content"


def database_of(work: Path) -> Path:
    """The feature database below a scan's `work/`."""
    return work / "features" / "features.db"


def find_features(job: Job, photos: Path, progress: Progress) -> None:
    """Run a job that finds and matches features, on what is left of a run before.

    Raises
    ------
    StageError : COLMAP failed.
    """
    database = Path(job.database)
    key = _key(job, photos)
    stamp = _read_stamp(database)
    content = stamp.pop(_CONTENT, "")
    # Learned features are put behind others: half of them could not be told from all.
    half = job.learned is not None and not content
    if stamp != key or half or not _is_sound(database, content):
        if stamp == key and not half:
            progress.note(f"{database.name} is damaged: features are found again")
        shutil.rmtree(database.parent, ignore_errors=True)
    write_json(database.parent / _STAMP, key)
    run_worker(job, progress)


def seal_features(database: Path) -> None:
    """Note the content of the database, once nobody opens it any more (mapping writes to it)."""
    stamp = _read_stamp(database)
    write_json(database.parent / _STAMP, {**stamp, _CONTENT: hash_path(database)})


def known_features(job: Job, work: Path, photos: Path) -> Path | None:
    """The feature database of another scan, if it holds what this job would find again.

    Parameters
    ----------
    work, photos : the other scan's folders.
    """
    database = database_of(work)
    told, wanted = _read_stamp(database), _feature_key(job, photos)
    fits = {name: told.get(name) for name in wanted} == wanted and database.is_file()
    return database if fits and _is_sound(database, told.get(_CONTENT, "")) else None


def _is_sound(database: Path, content: str) -> bool:
    """Whether the database is as it was when complete or, where a kill left it, readable."""
    if content:
        return hash_path(database) == content
    if not database.is_file():
        return True
    uri = f"{database.absolute().as_uri()}?immutable=1"  # nothing is written beside it
    try:
        with closing(sqlite3.connect(uri, uri=True)) as connection:
            return connection.execute("PRAGMA quick_check(1)").fetchone() == ("ok",)
    except sqlite3.DatabaseError:
        return False


def _read_stamp(database: Path) -> dict[str, Any]:
    try:
        stamp = read_json(database.parent / _STAMP)
    except InputError:
        return {}
    return stamp if isinstance(stamp, dict) else {}


def _key(job: Job, photos: Path) -> dict[str, Any]:
    # As JSON gives it back: lists, where the job has tuples.
    plain = msgspec.json.decode(msgspec.json.encode(job))
    key = {name: plain[name] for name in ("cameras", "images", "min_matches", "seed", "learned")}
    if job.known_features is not None and job.known_features.matches:
        key["taken_over"] = plain["known_features"]["names"]
    return key | _feature_key(job, photos)


def _feature_key(job: Job, photos: Path) -> dict[str, Any]:
    """What a photo's features follow from."""
    return {**msgspec.to_builtins(job.sift), "photos": hash_path(photos)}
