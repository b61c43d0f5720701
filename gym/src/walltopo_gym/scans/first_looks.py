"""The first look at a wall while its scan runs: made after some stages, dropped with the result."""

from __future__ import annotations

import logging
import subprocess
from hashlib import sha256
from uuid import UUID

from walltopo.core.children import describe_exit, python_module
from walltopo.pipeline.first_look import LOOKS
from walltopo.scans.folder import ScanFolder
from walltopo_gym.errors import NotFoundError
from walltopo_gym.storage.files import FileStore

_LOG = logging.getLogger("walltopo_gym.scans")
_LIMIT_S = 120


def store_first_look(store: FileStore, scan: UUID, folder: ScanFolder, stage: str) -> None:
    """Make and store a look at the wall if a stage has changed how it looks.

    A process of its own makes it, so that its memory is free afterwards. A look that fails is
    logged, and the scan goes on.
    """
    if stage not in LOOKS or not folder.sparse.is_dir():  # a part of a wall is scanned below it
        return
    out = folder.work / "first-look.glb"
    command = python_module("walltopo.pipeline.first_look", str(folder.root), str(out))
    try:
        done = subprocess.run(
            command, capture_output=True, text=True, timeout=_LIMIT_S, check=False
        )
    except subprocess.TimeoutExpired:
        _LOG.warning("scan %s: no look after %s within %d s", scan, stage, _LIMIT_S)
        return
    if done.returncode:
        why = (done.stderr.strip().splitlines() or [describe_exit(done.returncode)])[-1]
        _LOG.warning("scan %s: no look after %s: %s", scan, stage, why)
        return
    if out.exists():
        store.put(_key(scan), out.read_bytes())
        out.unlink()


def read_first_look(store: FileStore, scan: UUID) -> tuple[bytes, str] | None:
    """Return the GLB of a scan's latest look and its hash; None without one."""
    try:
        content = store.read(_key(scan))
    except NotFoundError:
        return None
    return content, sha256(content).hexdigest()


def drop_first_look(store: FileStore, scan: UUID) -> None:
    """Drop the look of a scan, whose result can be seen."""
    store.drop([_key(scan)])


def _key(scan: UUID) -> str:
    return f"pictures/{scan}/first-look.glb"
