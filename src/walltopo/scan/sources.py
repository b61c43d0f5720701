"""`sources.json`: the files of the user that the scan is made from."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Self

import msgspec

from walltopo.core import InputError
from walltopo.scan.document import Document
from walltopo.scan.photos import SkippedFile


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
