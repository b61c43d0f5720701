"""Cache COLMAP's feature database in `work/`; validate it against photos, settings and damage.

A killed run continues with the missing photos and pairs. An update into a reference reuses the
features of the reference's scan. `made-from.json` beside the database holds the cache key and, once
the database is complete, the hash of its content.
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
from walltopo.reconstruct.sparse.jobs import ColmapJob, run_worker

_STAMP = "made-from.json"
_CONTENT = "content"


def database_of(work: Path) -> Path:
    """Return the path of the feature database in a scan's `work/`."""
    return work / "features" / "features.db"


def find_features(job: ColmapJob, photos: Path, progress: Progress) -> None:
    """Run a job that finds and matches features; continue the database of an earlier run.

    Raises
    ------
    StageError : COLMAP failed.
    """
    database = Path(job.database)
    key = _key(job, photos)
    stamp = _read_stamp(database)
    content = stamp.pop(_CONTENT, "")
    # Learned features are appended to others, so an incomplete database cannot be recognised.
    is_partial = job.learned is not None and not content
    if stamp != key or is_partial or not _is_sound(database, content):
        if stamp == key and not is_partial:
            progress.note(f"{database.name} is damaged; finding the features again")
        shutil.rmtree(database.parent, ignore_errors=True)
    write_json(database.parent / _STAMP, key)
    run_worker(job, progress)


def seal_features(database: Path) -> None:
    """Write the hash of the database; call it after the last use, because mapping writes to it."""
    stamp = _read_stamp(database)
    write_json(database.parent / _STAMP, {**stamp, _CONTENT: hash_path(database)})


def known_features(job: ColmapJob, work: Path, photos: Path) -> Path | None:
    """Return the feature database of another scan if it holds the features of this job, else None.

    Parameters
    ----------
    work, photos : the other scan's folders.
    """
    database = database_of(work)
    stored, wanted = _read_stamp(database), _feature_key(job, photos)
    is_same = {name: stored.get(name) for name in wanted} == wanted and database.is_file()
    return database if is_same and _is_sound(database, stored.get(_CONTENT, "")) else None


def _is_sound(database: Path, content: str) -> bool:
    """Return whether the database is undamaged: equal to its hash, or readable if incomplete."""
    if content:
        return hash_path(database) == content
    if not database.is_file():
        return True
    # `immutable` stops SQLite from writing files beside the database.
    uri = f"{database.absolute().as_uri()}?immutable=1"
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


def _key(job: ColmapJob, photos: Path) -> dict[str, Any]:
    # The JSON round trip turns tuples into lists, as in the stored stamp.
    plain = msgspec.json.decode(msgspec.json.encode(job))
    key = {name: plain[name] for name in ("cameras", "images", "min_matches", "seed", "learned")}
    if job.known_features is not None and job.known_features.matches:
        key["taken_over"] = plain["known_features"]["names"]
    return key | _feature_key(job, photos)


def _feature_key(job: ColmapJob, photos: Path) -> dict[str, Any]:
    """Return the part of the cache key that determines a photo's features."""
    return {**msgspec.to_builtins(job.sift), "photos": hash_path(photos)}
