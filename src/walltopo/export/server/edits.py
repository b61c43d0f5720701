"""What the editor reads and saves: both edit files as one JSON document, with its version."""

from __future__ import annotations

import fcntl
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import msgspec

from walltopo.core import EnvironmentLacksError, InputError
from walltopo.core.files import atomic_path, hash_path
from walltopo.scans.document import parse
from walltopo.scans.folder import ScanFolder
from walltopo.scans.old_edits import HoldEdits, RouteEdits

__all__ = ["EditDocument", "EditsChangedError", "edits_version", "read_edits", "save_edits"]


class EditsChangedError(InputError):
    """The files are not those any more that the edits were made on."""


class EditDocument(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """`{"holds": holds.edits.json, "routes": routes.edits.toml}`."""

    holds: HoldEdits
    routes: RouteEdits


def edits_version(scan: ScanFolder) -> str:
    """A text that changes when either file does, whoever writes it."""
    return f"{hash_path(scan.hold_edits)}-{hash_path(scan.route_edits)}"


def read_edits(scan: ScanFolder) -> tuple[dict[str, Any], str]:
    """The edits of a scan, JSON-able, and their version.

    The version is taken first: where a save falls between, the next save is refused, not lost.
    """
    version = edits_version(scan)
    edits = EditDocument(HoldEdits.load(scan.hold_edits), RouteEdits.load(scan.route_edits))
    plain: dict[str, Any] = msgspec.to_builtins(edits)
    return plain, version


def save_edits(scan: ScanFolder, edits: object, version: str) -> str:
    """Write both edit files or none; gives their new version.

    Both are written and read back before the first takes its place. What can still part them is
    the machine stopping between two renames.

    Parameters
    ----------
    version : of the files that the edits were made on.

    Raises
    ------
    InputError : the document is not what `read_edits` gives.
    EditsChangedError : the files have another version now.
    EnvironmentLacksError : they cannot be written.
    """
    document = parse(edits, EditDocument, "edits")
    with _alone(scan):
        if version != edits_version(scan):
            raise EditsChangedError(
                "other edits were saved since this page read them; nothing was changed",
                "Reload to go on from those: what was done here since is then gone.",
            )
        for path in (scan.hold_edits, scan.route_edits):
            if path.exists() and not path.is_file():
                raise InputError(f"{path.name} is in the way: it is not a file")
        with atomic_path(scan.hold_edits) as holds, atomic_path(scan.route_edits) as routes:
            document.holds.save(holds)
            document.routes.save(routes)
            if EditDocument(HoldEdits.load(holds), RouteEdits.load(routes)) != document:
                raise InputError("edits: they would read differently from the files")
        return edits_version(scan)


@contextmanager
def _alone(scan: ScanFolder) -> Iterator[None]:
    """One save at a time, over threads and servers, so that none falls between look and write."""
    try:
        stream = (scan.root / ".edits.lock").open("w")
    except OSError as error:
        raise EnvironmentLacksError(f"cannot write to {scan.root}: {error.strerror}") from error
    with stream:
        fcntl.flock(stream, fcntl.LOCK_EX)
        yield
