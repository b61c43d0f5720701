"""The entries of a backup, and the check that a file has them and nothing else.

A backup may come from a stranger: each entry is a plain file whose name the store can take.
"""

from __future__ import annotations

import hashlib
import lzma
import re
import tarfile
import unicodedata
import zlib
from datetime import datetime
from pathlib import Path, PurePosixPath
from typing import IO, Final

import msgspec

from walltopo.core import InputError
from walltopo_gym.settings import FILE

TABLES: Final = {"sqlite": "database.sqlite", "postgresql": "database.pgdump"}
FILES: Final = "files/"
CONTENTS: Final = "contents.json"  # the last entry: a backup that was cut off has none

_MAX_KEY_BYTES: Final = 1000  # S3 takes 1024
_MAX_PART_BYTES: Final = 250  # file systems take 255; obstore writes under a longer name first
_STAGED: Final = re.compile(r"#\d+$")  # obstore's own files while it writes

# `tarfile` and its decompressors raise these on damaged files.
_DAMAGE: Final = (
    OSError,
    EOFError,
    ValueError,
    OverflowError,
    MemoryError,
    RecursionError,
    tarfile.TarError,
    zlib.error,
    lzma.LZMAError,
    msgspec.MsgspecError,
)


class TableDigest(msgspec.Struct, frozen=True):
    """The number of a table's rows, and the sum of their SHA-256 in hex digits."""

    rows: int
    digest: str


class Contents(msgspec.Struct):
    """Contents of a backup.

    Parameters
    ----------
    hashes : SHA-256 of each entry by its name.
    tables : digest of each table by its name. made_at, version : when it was made, and by which
        version. Backups that were made before 2026-12 have none of these.
    """

    hashes: dict[str, str]
    tables: dict[str, TableDigest] | None = None
    made_at: datetime | None = None
    version: str = ""

    @property
    def files(self) -> dict[str, str]:
        """Return the SHA-256 of each file of the store by its key."""
        return {
            name.removeprefix(FILES): hashed
            for name, hashed in self.hashes.items()
            if name.startswith(FILES)
        }


def check_backup(source: Path, tables: str) -> Contents:
    """Check that a backup is whole, of this kind of database, and has no other entries.

    Parameters
    ----------
    tables : name of the entry with the database's tables.

    Returns
    -------
    contents : the list of its entries.

    Raises
    ------
    InputError : it is not.
    """
    hashes: dict[str, str] = {}
    listed: Contents | None = None
    try:
        with tarfile.open(source, "r:") as tar:
            for entry in tar:
                content = _entry_content(source, tar, entry)
                if entry.name in hashes or (entry.name == CONTENTS and listed is not None):
                    raise InputError(f"{source}: {_quote_name(entry.name)} is in it twice")
                if entry.name == CONTENTS:
                    listed = msgspec.json.decode(content.read(), type=Contents)
                else:
                    hashes[entry.name] = _hash_content(content)
    except _DAMAGE as error:
        raise InputError(f"{source}: cannot be read as a backup ({error})") from error
    if listed is None or listed.hashes != hashes:
        raise InputError(f"{source}: this backup is damaged or was cut off", "Take another one.")
    _refuse_files_in_files(source, hashes)
    if tables not in hashes:
        kind = "PostgreSQL" if TABLES["postgresql"] in hashes else "SQLite"
        raise InputError(f"{source}: a backup of {kind}", f"Restore it into {kind}.")
    return listed


def tables_size(source: Path) -> int:
    """Return the number of bytes of a backup's tables, its first entry; 0 for a damaged one."""
    try:
        with tarfile.open(source, "r:") as tar:
            first = tar.next()
    except _DAMAGE:
        return 0
    return first.size if first is not None and first.name in TABLES.values() else 0


def _entry_content(source: Path, tar: tarfile.TarFile, entry: tarfile.TarInfo) -> IO[bytes]:
    """Return the content of an entry of a backup.

    Raises
    ------
    InputError : the entry is not a plain file with a name that a backup has.
    """
    is_plain = entry.type in (tarfile.REGTYPE, tarfile.AREGTYPE) and not entry.issparse()
    is_known = entry.name in (CONTENTS, FILE, *TABLES.values()) or (
        entry.name.startswith(FILES) and _is_key(entry.name.removeprefix(FILES))
    )
    content = tar.extractfile(entry) if is_plain and is_known and entry.size >= 0 else None
    if content is None:
        raise InputError(
            f"{source}: {_quote_name(entry.name)} belongs in no backup", "Take another one."
        )
    return content


def _is_key(key: str) -> bool:
    """Return whether the store of files can take a key, in a folder and on S3."""
    parts = key.split("/")
    return (
        not any(unicodedata.category(one) in ("Cc", "Cs") for one in key)
        and len(key.encode()) <= _MAX_KEY_BYTES
        and all(part not in ("", ".", "..") for part in parts)
        and all(len(part.encode()) <= _MAX_PART_BYTES for part in parts)
        and not _STAGED.search(key)
    )


def _refuse_files_in_files(source: Path, hashes: dict[str, str]) -> None:
    """Refuse a name that is a file and a folder, which only S3 can store.

    Raises
    ------
    InputError : there is one.
    """
    folders = {str(folder) for name in hashes for folder in PurePosixPath(name).parents}
    both = folders & hashes.keys()
    if both:
        raise InputError(f"{source}: {_quote_name(min(both))} is a file and a folder in it")


def _quote_name(name: str) -> str:
    return repr(name if len(name) <= 100 else f"{name[:100]}...")


def _hash_content(content: IO[bytes]) -> str:
    digest = hashlib.sha256()
    while piece := content.read(1 << 20):
        digest.update(piece)
    return digest.hexdigest()
