"""A scan folder in the store, so that another worker goes on with it.

The folder on a worker's disk is a copy. After each stage its files are put on the shelf, the
manifest last: whoever takes the folder from there finds every file that the manifest knows, or
makes it again (`walltopo.pipeline` compares contents).
"""

from __future__ import annotations

import mimetypes
from pathlib import Path
from typing import Any
from uuid import UUID

from walltopo.core.files import files_below
from walltopo.pipeline.stages import stage_named
from walltopo.publish.kept_tiers import TIERS
from walltopo.scans.folder import ScanFolder
from walltopo_gym.storage.files import FileStore, hash_of_file

# What is shown of a published wall.
_VISIBLE = ("page", "page_assets", "glb", "holds", "routes")


def _prefix(scan: UUID) -> str:
    return f"scans/{scan}"


def shelve_stage(store: FileStore, scan: UUID, folder: ScanFolder, stage: str) -> None:
    """Put on the shelf what a stage made."""
    for item in stage_named(stage).writes:
        shelve(store, scan, folder, item.in_folder(folder))
    if stage == "export":  # can be made again, but an edit would take as long as an export
        shelve(store, scan, folder, folder.work / TIERS)
    store.put(f"{_prefix(scan)}/{folder.manifest.name}", folder.manifest)


def shelve(store: FileStore, scan: UUID, folder: ScanFolder, path: Path) -> None:
    """Put a file or a folder of the scan folder on the shelf, where it is there."""
    files = files_below(path) if path.is_dir() else [path] if path.is_file() else []
    for file in files:
        store.put(f"{_prefix(scan)}/{file.relative_to(folder.root).as_posix()}", file)


def take_scan(store: FileStore, scan: UUID, folder: ScanFolder) -> None:
    """Take what is on the shelf and not in the folder."""
    prefix = _prefix(scan) + "/"
    keys = store.keys(prefix)
    manifest = prefix + folder.manifest.name
    for key in sorted(keys, key=lambda key: key == manifest):
        path = folder.root / key.removeprefix(prefix)
        if not path.exists():
            store.fetch(key, path)


def take_files(store: FileStore, scan: UUID, folder: ScanFolder, *names: str) -> None:
    """Take single files, by the names of the scan folder.

    Raises
    ------
    NotFoundError : the scan has not come so far.
    """
    for name in names:
        path: Path = getattr(folder, name)
        store.fetch(f"{_prefix(scan)}/{path.relative_to(folder.root).as_posix()}", path)


def take_visible(store: FileStore, folder: ScanFolder) -> dict[str, Any]:
    """Keep what the public sees under the names of its content; path to key, size and type."""
    found: dict[str, Any] = {}
    for name in _VISIBLE:
        path: Path = getattr(folder, name)
        for file in files_below(path) if path.is_dir() else [path]:
            if not file.is_file():
                continue
            content = hash_of_file(file)
            key = f"content/{content}"
            store.put(key, file)  # also where it is already: a purge leaves young files alone
            kind = mimetypes.guess_type(file.name)[0] or "application/octet-stream"
            shown = file.relative_to(folder.root).as_posix()
            found[shown] = {"key": key, "size": file.stat().st_size, "type": kind}
    return found
