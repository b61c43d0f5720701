"""Copy scan folders to and from an object store (obstore: a folder, S3, Azure, GCS).

A key is a prefix and a path inside the folder. The manifest lists the content of each file and is
copied last in both directions, so that a copy with a manifest is complete or can be completed.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Final

from walltopo.core import EnvironmentLacksError, InputError
from walltopo.core.files import atomic_path, join_inside
from walltopo.scans.folder import ScanFolder

if TYPE_CHECKING:  # an optional package
    from obstore.store import ObjectStore

_CHUNK: Final = 1 << 20


def open_store(url: str) -> ObjectStore:
    """Return the store behind a URL, such as s3://bucket/prefix.

    Raises
    ------
    EnvironmentLacksError : obstore is not installed.
    InputError : obstore does not know the URL.
    """
    try:
        from obstore.store import from_url
    except ImportError as error:
        raise EnvironmentLacksError(
            f"{url} needs obstore, which is not installed", "pip install 'walltopo[s3]'"
        ) from error
    try:
        return from_url(url)
    except Exception as error:  # each kind of store has its own class
        raise InputError(f"{url!r} is not a known object store ({error})") from error


def fetch_file(store: ObjectStore, key: str, path: Path) -> None:
    """Write one object to `path`, whole or not at all.

    Raises
    ------
    FileNotFoundError : the key does not exist.
    """
    import obstore

    pieces = obstore.get(store, key).stream(min_chunk_size=_CHUNK)
    path.parent.mkdir(parents=True, exist_ok=True)
    with atomic_path(path) as temporary, temporary.open("wb") as stream:
        for piece in pieces:
            stream.write(bytes(piece))


def fetch_missing(store: ObjectStore, folder: Path, prefix: str = "") -> int:
    """Copy the objects below a prefix that a folder lacks; return the number of objects.

    Raises
    ------
    InputError : a key points out of the folder.
    """
    import obstore

    keys = [str(item["path"]) for page in obstore.list(store, prefix or None) for item in page]
    manifest = prefix + ScanFolder(folder).manifest.name
    for key in sorted(keys, key=lambda key: (key == manifest, key)):
        path = join_inside(folder, key.removeprefix(prefix))
        if not path.exists():
            fetch_file(store, key, path)
    return len(keys)


def send_files(store: ObjectStore, folder: Path, files: Iterable[Path], prefix: str = "") -> None:
    """Copy files of a folder into the store."""
    import obstore

    manifest = ScanFolder(folder).manifest
    for file in sorted(files, key=lambda file: (file == manifest, file)):
        obstore.put(store, prefix + file.relative_to(folder).as_posix(), file)
