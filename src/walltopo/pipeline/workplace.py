"""The folder that a scan works in: made ready, swept of leftovers, held by one process."""

from __future__ import annotations

import fcntl
import itertools
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from walltopo.core import BusyError, EnvironmentLacksError, InputError
from walltopo.scans.folder import ScanFolder, owning_scan

_LOCK = ".lock"


@contextmanager
def held(folder: ScanFolder) -> Iterator[None]:
    """The folder ready for a run, for this process alone.

    Raises
    ------
    InputError : it is no scan folder, and not empty.
    EnvironmentLacksError : it cannot be written. BusyError : another run is at work on it.
    """
    _prepare(folder)
    with _locked(folder):
        _sweep(folder)
        yield


def is_held(folder: ScanFolder) -> bool:
    """Whether a run is at work on the folder at this moment."""
    try:
        stream = (folder.root / _LOCK).open("r")
    except OSError:
        return False
    with stream:
        try:
            fcntl.flock(stream, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except OSError:
            return True
        return False


def set_aside(folder: ScanFolder, path: Path) -> Path:
    """Move what lies at `path` to `set-aside/` of its scan, under a name that is free there."""
    shelf = folder.root / "set-aside"
    shelf.mkdir(exist_ok=True)
    names = (f"{path.stem}{k}{path.suffix}" for k in itertools.chain([""], itertools.count(2)))
    free = next(shelf / name for name in names if not (shelf / name).exists())
    path.rename(free)
    return free


def _prepare(folder: ScanFolder) -> None:
    root = folder.root
    if root.exists() and not root.is_dir():
        raise InputError(f"{root}: is a file, expected a folder for the scan")
    owner = owning_scan(root)
    if owner is not None and owner.root != root.absolute():
        raise InputError(
            f"{root}: lies among the files of the scan {owner.root}",
            "Choose another output folder; nothing was changed.",
        )
    if root.is_dir() and not folder.manifest.exists() and _has_files(root):
        raise InputError(
            f"{root}: is not empty and not a scan folder",
            "Choose another output folder; nothing was changed.",
        )
    try:
        root.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise EnvironmentLacksError(f"cannot create {root}: {error.strerror}") from error
    if not os.access(root, os.W_OK):
        raise EnvironmentLacksError(f"cannot write to {root}: permission denied")


def _has_files(root: Path) -> bool:
    return any(not item.name.startswith(".") for item in root.iterdir())


def _sweep(folder: ScanFolder) -> None:
    """Remove what a killed run left half-written; finished files are never in these folders."""
    for parent in (folder.root, folder.work):
        for leftover in parent.glob(".partial-*"):
            shutil.rmtree(leftover, ignore_errors=True)


@contextmanager
def _locked(folder: ScanFolder) -> Iterator[None]:
    """Hold the folder for this process; the lock vanishes with the process."""
    try:
        stream = (folder.root / _LOCK).open("w")
    except OSError as error:
        raise EnvironmentLacksError(f"cannot write to {folder.root}: {error.strerror}") from error
    with stream:
        try:
            fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            raise BusyError(
                f"{folder.root}: another walltopo is at work on this scan",
                "Wait for it or stop it first.",
            ) from error
        yield
