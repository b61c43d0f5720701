"""Scan folders in the object store, so that any worker can continue a scan.

The folder on a worker's disk is a copy. After each stage its new files are uploaded.
"""

from __future__ import annotations

import mimetypes
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final
from uuid import UUID

from walltopo.core.files import files_below
from walltopo.pipeline.runner import stored_plan
from walltopo.publish.page_tiers import TIERS
from walltopo.reconstruct.landmarks import landmarks_basis, landmarks_fit
from walltopo.scans.edits import EditLog
from walltopo.scans.folder import ScanFolder, read_edits
from walltopo.scans.folder import read_joined as joined_of
from walltopo.scans.joined import Joined
from walltopo.scans.manifest import Manifest
from walltopo.scans.object_store import fetch_missing, send_files
from walltopo_gym.errors import NotFoundError
from walltopo_gym.storage.files import FileStore, hash_of_file

MOVES_FILE: Final = "moves.json"  # added after the publication (publishing/moves.py)


def _key_prefix(scan: UUID) -> str:
    return f"scans/{scan}"


def upload_stage(store: FileStore, scan: UUID, folder: ScanFolder, stage: str) -> None:
    """Upload the files that a stage wrote, and drop the optional ones that it wrote before."""
    made = [path for step in stored_plan(folder) if step.name == stage for path in step.writes]
    if stage == "export":  # can be made again, but an edit would take as long as an export
        made.append(folder.work / TIERS)
    store.drop([_file_key(scan, folder, path) for path in made if not path.exists()])
    upload_files(store, scan, folder, *made, folder.manifest)


def upload_files(store: FileStore, scan: UUID, folder: ScanFolder, *paths: Path) -> None:
    """Upload existing files and folders of the scan folder."""
    files = [file for path in paths for file in (files_below(path) if path.is_dir() else [path])]
    there = (file for file in files if file.is_file())
    send_files(store.objects, folder.root, there, f"{_key_prefix(scan)}/")


def drop_part(store: FileStore, scan: UUID) -> None:
    """Drop the files of a partial rescan before it was joined: nothing reads them any more."""
    folder = ScanFolder("")
    store.drop(store.keys(f"{_file_key(scan, folder, folder.part.root)}/"))


def drop_joined(store: FileStore, scan: UUID) -> bool:
    """Drop the files of a scan that an older walltopo joined in place, so that it starts again.

    Its earlier stages could not run again, with other photos or another reference. Returns whether
    it was one.
    """
    below = f"{_key_prefix(scan)}/"
    if not store.has(f"{below}scan.json") or read_manifest(store, scan).joined is None:
        return False
    store.drop(store.keys(below))
    return True


def read_manifest(store: FileStore, scan: UUID) -> Manifest:
    """Return the stored manifest of a scan.

    Raises
    ------
    NotFoundError : the scan has not come so far.
    """
    with tempfile.TemporaryDirectory() as name:
        folder = ScanFolder(Path(name))
        download_files(store, scan, folder, folder.manifest)
        return Manifest.load(folder.manifest)


def read_joined(store: FileStore, scan: UUID) -> Joined | None:
    """Return what a partial rescan replaced of its reference; None for other scans."""
    with _present_files(store, scan, "manifest", "joined") as folder:
        return joined_of(folder)


def read_carried(store: FileStore, scan: UUID) -> EditLog:
    """Return the edit log that a partial rescan carried from its reference; else an empty one."""
    with _present_files(store, scan, "manifest", "carried", "edits") as folder:
        return carried_log(folder)


@contextmanager
def _present_files(store: FileStore, scan: UUID, *names: str) -> Iterator[ScanFolder]:
    """Yield a temporary scan folder with some files, as far as the store has them.

    Parameters
    ----------
    names : attributes of `ScanFolder`.
    """
    with tempfile.TemporaryDirectory() as name:
        folder = ScanFolder(Path(name))
        _download_present(store, scan, folder, *(getattr(folder, name) for name in names))
        yield folder


def _file_key(scan: UUID, folder: ScanFolder, path: Path) -> str:
    """Return the key of a file of a scan folder in the store."""
    return f"{_key_prefix(scan)}/{path.relative_to(folder.root).as_posix()}"


def carried_log(folder: ScanFolder) -> EditLog:
    """Return the log of a scan folder before any edit of the scan itself.

    A scan that an older walltopo joined in place has it in `edits.json`; else that file is of an
    earlier run, whose coordinates were others.
    """
    if Manifest.load(folder.manifest).joined is not None:
        return read_edits(folder)
    return ScanFolder.carried.load(folder) or EditLog()


def download_scan(store: FileStore, scan: UUID, folder: ScanFolder) -> None:
    """Download the files that are missing in the folder."""
    fetch_missing(store.objects, folder.root, f"{_key_prefix(scan)}/")


def download_sparse(store: FileStore, scan: UUID, root: Path) -> Path:
    """Download the sparse model of a scan below `root`; return its folder.

    Raises
    ------
    NotFoundError : the scan has not come so far.
    """
    folder = ScanFolder(root).sparse
    prefix = f"{_key_prefix(scan)}/{folder.name}/"
    if fetch_missing(store.objects, folder, prefix) == 0:
        raise NotFoundError("file-gone")
    return folder


def landmarks_of(folder: ScanFolder) -> Path:
    """Return the path of the landmarks of a scan's photos."""
    return folder.work / "landmarks.npz"


def download_wall(store: FileStore, scan: UUID, folder: ScanFolder) -> None:
    """Download a scan's wall as clips are compared with it: mesh, holds and routes, and either the
    landmarks of its photos or, until those are stored, the photos.

    Raises
    ------
    NotFoundError : the scan has not come so far.
    """
    download_sparse(store, scan, folder.root)
    needed = (folder.mesh, folder.instances, folder.holds, folder.routes)
    download_files(store, scan, folder, *needed)
    kept = landmarks_of(folder)
    _download_present(store, scan, folder, folder.relabelled, kept)
    if landmarks_fit(kept, landmarks_basis(folder)):
        return
    prefix = f"{_file_key(scan, folder, folder.photos)}/"
    if fetch_missing(store.objects, folder.photos, prefix) == 0:
        raise NotFoundError("file-gone")


def download_surface(store: FileStore, scan: UUID, folder: ScanFolder) -> None:
    """Download a scan's holds and its textured surface.

    Raises
    ------
    NotFoundError : the scan has not come so far, or its files are gone.
    """
    needed = (folder.mesh, folder.texture, folder.texture_uv, folder.instances)
    download_files(store, scan, folder, *needed, folder.holds, folder.scale)
    _download_present(store, scan, folder, folder.relabelled)


def upload_landmarks(store: FileStore, scan: UUID, folder: ScanFolder) -> None:
    """Store the landmarks that were found in a scan's photos, if the photos are here."""
    if folder.photos.is_dir():
        upload_files(store, scan, folder, landmarks_of(folder))


def download_files(store: FileStore, scan: UUID, folder: ScanFolder, *files: Path) -> None:
    """Download single files of a scan folder.

    Raises
    ------
    NotFoundError : the scan has not come so far.
    """
    for path in files:
        store.fetch(_file_key(scan, folder, path), path)


def _download_present(store: FileStore, scan: UUID, folder: ScanFolder, *files: Path) -> None:
    """Download those of some files that the store has."""
    download_files(
        store, scan, folder, *(f for f in files if store.has(_file_key(scan, folder, f)))
    )


def store_public_file(store: FileStore, file: Path) -> dict[str, Any]:
    """Store a public file under the hash of its content; return key, size and type."""
    key = f"content/{hash_of_file(file)}"
    store.put(key, file)  # also where it is already: a purge leaves young files alone
    kind = mimetypes.guess_type(file.name)[0] or "application/octet-stream"
    return {"key": key, "size": file.stat().st_size, "type": kind}


def store_public_files(store: FileStore, folder: ScanFolder) -> dict[str, Any]:
    """Store public files under hashes of their content; return path to key, size and type."""
    found: dict[str, Any] = {}
    for path in (folder.page, folder.page_assets, folder.glb, folder.holds, folder.routes):
        for file in files_below(path) if path.is_dir() else [path]:
            if file.is_file():
                shown = file.relative_to(folder.root).as_posix()
                found[shown] = store_public_file(store, file)
    return found
