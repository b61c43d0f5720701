"""Lock a scan folder, clean it, and decide which stages are up to date."""

from __future__ import annotations

import hashlib
import itertools
import json
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from walltopo.core import BusyError, EnvironmentLacksError, InputError, settings_of
from walltopo.core.files import HashCache, as_text, files_below, is_special, shipped_file
from walltopo.core.locks import take_lock
from walltopo.geometry.mesh_files import files_of_mesh
from walltopo.pipeline.plan import Step
from walltopo.pipeline.settings import Settings
from walltopo.scans.artifacts import Artifact
from walltopo.scans.folder import ScanFolder, owning_scan
from walltopo.scans.manifest import Output, StageRecord

_LOCK = ".lock"


@contextmanager
def locked(folder: ScanFolder) -> Iterator[None]:
    """Prepare a scan folder and lock it for this process during the block.

    Raises
    ------
    InputError : the folder is not empty and not a scan folder.
    EnvironmentLacksError : the folder cannot be written.
    BusyError : another run holds the lock.
    """
    _create_scan_folder(folder)
    with _hold_lock(folder):
        _remove_partial(folder)
        yield


def is_locked(folder: ScanFolder) -> bool:
    """Return whether a run holds the lock of the folder."""
    try:
        stream = (folder.root / _LOCK).open("r")
    except OSError:
        return False
    with stream:
        return not take_lock(stream, shared=True)


def set_aside(folder: ScanFolder, path: Path) -> Path:
    """Move a file to `set-aside/` of its scan under a free name; return its new path."""
    aside = folder.root / "set-aside"
    aside.mkdir(exist_ok=True)
    names = (f"{path.stem}{k}{path.suffix}" for k in itertools.chain([""], itertools.count(2)))
    free = next(aside / name for name in names if not (aside / name).exists())
    path.rename(free)
    return free


def _create_scan_folder(folder: ScanFolder) -> None:
    """Create the scan folder; raise if it cannot be used."""
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


def _remove_partial(folder: ScanFolder) -> None:
    """Remove the temporary folders of a killed run; finished files are never in them."""
    for parent in (folder.root, folder.work, folder.part.root, folder.part.work):
        for leftover in parent.glob(".partial-*"):
            shutil.rmtree(leftover, ignore_errors=True)


@contextmanager
def _hold_lock(folder: ScanFolder) -> Iterator[None]:
    """Hold the lock of the folder; the system releases it when the process exits."""
    if is_special(folder.root / _LOCK):
        raise InputError(f"{folder.root / _LOCK}: is a device, a pipe or a socket; delete it")
    try:
        stream = (folder.root / _LOCK).open("w")
    except OSError as error:
        raise EnvironmentLacksError(f"cannot write to {folder.root}: {error.strerror}") from error
    with stream:
        if not take_lock(stream):
            raise BusyError(
                f"{folder.root}: another walltopo process is working on this scan",
                "Wait for it or stop it first.",
            )
        yield


@dataclass(frozen=True)
class InputHash:
    """The hash of everything that determines a stage's outputs; `elsewhere` as in `StageRecord`."""

    hash: str
    elsewhere: dict[str, str]


def input_hash(
    step: Step, settings: Settings, hashes: HashCache, record: StageRecord | None
) -> InputHash:
    """Return the hash of a stage's inputs, settings, models and version.

    A reference that was deleted counts as it was when the stage last ran.

    Parameters
    ----------
    record : of the stage's last run.
    """
    stage, known = step.stage, {} if record is None else record.elsewhere
    elsewhere: dict[str, str] = {}

    def hash_elsewhere(root: Path, path: Path, item: Artifact[Any] | None = None) -> str:
        key = as_text(path)
        found = _hash_of(path, item, hashes) if root.exists() else known.get(key, "")
        if found:
            elsewhere[key] = found
        return found

    section = settings.as_dict()[stage.settings_section]
    parts: list[Any] = [stage.name, stage.version, section]
    # A setting that names a file (a model, a palette, a reference) is hashed by the file's content.
    named = _named_paths(stage.settings_of(settings))
    parts += [found for root, path in named if (found := hash_elsewhere(root, path))]
    parts += [hashes.hash(shipped_file(name)) for name in stage.models]
    for item in stage.reads:
        parts.append([item.name, _hash_of(item.in_folder(step.folder), item, hashes)])
    for scan, item in stage.reads_elsewhere:
        other = step.others[scan]
        parts.append([scan, item.name, hash_elsewhere(other.root, item.in_folder(other), item)])
    text = json.dumps(parts, sort_keys=True, default=str)
    return InputHash(hashlib.blake2b(text.encode(), digest_size=16).hexdigest(), elsewhere)


def _hash_of(path: Path, item: Artifact[Any] | None, hashes: HashCache) -> str:
    return item.fingerprint(path) if item and item.fingerprint else hashes.hash(path)


def outputs_of(step: Step, hashes: HashCache) -> dict[str, Output]:
    """Return the size and hash of a stage's outputs by artifact name."""
    return {item.name: _output(item.in_folder(step.folder), hashes) for item in step.stage.writes}


def changed_outputs(step: Step, record: StageRecord, hashes: HashCache) -> list[Artifact[Any]]:
    """Return the artifacts that are missing or differ from what the stage wrote.

    For a record without hashes (older walltopo), only missing artifacts are found.
    """
    found = []
    for item in step.stage.writes:
        path = item.in_folder(step.folder)
        recorded = record.outputs.get(item.name)
        if recorded is not None:
            changed = hashes.hash(path) != recorded.hash
        else:
            changed = not (path.exists() or item.optional)
        if changed:
            found.append(item)
    return found


def _output(path: Path, hashes: HashCache) -> Output:
    files = files_below(path) if path.is_dir() else [path] if path.is_file() else []
    return Output(sum(file.stat().st_size for file in files), hashes.hash(path))


def _named_paths(section: Any) -> Iterator[tuple[Path, Path]]:
    """Yield the files and folders that a stage's settings name and whose content counts, each with
    the path in the setting."""
    for name, declared in settings_of(type(section)).items():
        value = getattr(section, name)
        for part in declared.content if value else ():
            root, path = Path(value), Path(value) / part
            # Ignore a folder that happens to have the name of a built-in choice.
            if path.is_file() or part != ".":
                yield root, path
                for file in files_of_mesh(path):
                    yield root, file
