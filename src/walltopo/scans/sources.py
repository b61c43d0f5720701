"""`sources.json`: the files of the user that the scan is made from."""

from __future__ import annotations

import hashlib
import json
import os
from pathlib import Path
from typing import Self

import msgspec

from walltopo.core import InputError
from walltopo.core.files import as_text
from walltopo.scans.document import Document, read_document
from walltopo.scans.photos import SkippedFile


class SourceFile(msgspec.Struct, frozen=True):
    """One photo or video of the user.

    Parameters
    ----------
    path : absolute path as the bytes of the file system, which need not be UTF-8.
    content : hash of the file.
    """

    path: bytes
    content: str

    @property
    def file(self) -> Path:
        """Return the path of the file."""
        return Path(os.fsdecode(self.path))


class SourceList(Document, frozen=True, kw_only=True):
    """`sources.json`: what ingest reads, in natural order, and what lies beside it unread."""

    files: tuple[SourceFile, ...]
    skipped: tuple[SkippedFile, ...] = ()

    @property
    def contents(self) -> list[tuple[str, str]]:
        """Return name and content hash of each file: what a scan depends on, wherever they lie."""
        return [(as_text(item.file.name), item.content) for item in self.files]

    @classmethod
    def fingerprint(cls, path: Path) -> str:
        """Return a hash of `contents`; "" where there is no list."""
        if not path.exists():
            return ""
        text = json.dumps(read_document(path, cls).contents)
        return hashlib.blake2b(text.encode(), digest_size=16).hexdigest()

    @classmethod
    def load(cls, path: Path) -> Self:
        """Return the list.

        Raises
        ------
        InputError : the list is damaged, or one of its files is gone.
        """
        sources = super().load(path)
        gone = next((item.file for item in sources.files if not item.file.exists()), None)
        if gone is not None:
            raise InputError(
                f"{path.parent}: {gone} is gone since the scan was made",
                "Give the photos again, or go on with what is there by --accept-changes.",
            )
        return sources
