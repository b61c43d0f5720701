"""Whether a stage must run: its inputs and settings as they were, its outputs as it left them."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from walltopo.core import settings_of
from walltopo.core.files import files_below
from walltopo.core.hashes import Ledger
from walltopo.pipeline.settings import Settings
from walltopo.pipeline.stage import Stage
from walltopo.scans.artifacts import Artifact
from walltopo.scans.folder import ScanFolder
from walltopo.scans.manifest import Output, StageRecord


def input_hash(folder: ScanFolder, stage: Stage, settings: Settings, ledger: Ledger) -> str:
    """Return a hash of what a stage's outputs follow from: inputs, settings, code version."""
    section = settings.as_dict()[stage.name]
    parts: list[Any] = [stage.name, stage.version, section]
    # A setting that names a file (a model, a palette, a reference) counts by its content.
    parts += [ledger.hash(path) for path in _named_paths(getattr(settings, stage.name))]
    for item in stage.reads:
        path = item.in_folder(folder)
        parts.append([item.name, item.fingerprint(path) if item.fingerprint else ledger.hash(path)])
    text = json.dumps(parts, sort_keys=True, default=str)
    return hashlib.blake2b(text.encode(), digest_size=16).hexdigest()


def outputs_of(folder: ScanFolder, stage: Stage, ledger: Ledger) -> dict[str, Output]:
    """What a stage's outputs are at this moment, by the names of the artifacts."""
    return {item.name: _output(item.in_folder(folder), ledger) for item in stage.writes}


def changed_outputs(
    folder: ScanFolder, stage: Stage, record: StageRecord, ledger: Ledger
) -> list[Artifact[Any]]:
    """Return the artifacts that are missing, or not what the stage left.

    A record without hashes (of an older walltopo) tells only what is missing.
    """
    found = []
    for item in stage.writes:
        path = item.in_folder(folder)
        left = record.outputs.get(item.name)
        if left is not None:
            changed = ledger.hash(path) != left.hash
        else:
            changed = not (path.exists() or item.optional)
        if changed:
            found.append(item)
    return found


def _output(path: Path, ledger: Ledger) -> Output:
    files = files_below(path) if path.is_dir() else [path] if path.is_file() else []
    return Output(sum(file.stat().st_size for file in files), ledger.hash(path))


def _named_paths(section: Any) -> Iterator[Path]:
    """Existing files and folders that the settings of a stage name and whose content counts."""
    for name, declared in settings_of(type(section)).items():
        value = getattr(section, name)
        for part in declared.content if value else ():
            path = Path(value) / part
            # A folder that happens to be called like a built-in choice is not what was meant.
            if path.is_file() or (part != "." and path.exists()):
                yield path
