"""What a page of an older walltopo reads and saves: the two files before `edits.json`."""

from __future__ import annotations

import fcntl
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import msgspec

from walltopo.core import EnvironmentLacksError, InputError
from walltopo.core.files import atomic_path, hash_path
from walltopo.export.server.desk import EditsChangedError
from walltopo.scans.document import parse
from walltopo.scans.folder import ScanFolder
from walltopo.scans.old_edits import HoldEdits, RouteEdits

__all__ = ["EditDocument", "edits_version", "read_old", "save_edits"]


class EditDocument(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """`{"holds": holds.edits.json, "routes": routes.edits.toml}`."""

    holds: HoldEdits
    routes: RouteEdits


def edits_version(scan: ScanFolder) -> str:
    """A text that changes when a file of edits does, whoever writes it."""
    return "-".join(hash_path(path) for path in (scan.edits, scan.hold_edits, scan.route_edits))


def read_old(scan: ScanFolder) -> dict[str, Any]:
    """Both files, JSON-able, by the names that older pages know."""
    edits = EditDocument(HoldEdits.load(scan.hold_edits), RouteEdits.load(scan.route_edits))
    plain: dict[str, Any] = msgspec.to_builtins(edits)
    return plain


def save_edits(scan: ScanFolder, edits: object, version: str) -> str:
    """Write both edit files or none; gives their new version.

    Both are written and read back before the first takes its place. What can still part them is
    the machine stopping between two renames.

    Parameters
    ----------
    version : of the files that the edits were made on.

    Raises
    ------
    InputError : the document is not what `read_old` gives, or the page is too old for the scan.
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
        if scan.edits.exists():
            raise InputError(
                "this page is of an older walltopo, and the scan has newer edits",
                f"Run `walltopo scan -o {scan.root}` once and reload.",
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
