"""Report the state of a scan without running it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import msgspec

from walltopo.core import InputError
from walltopo.core.files import HashCache
from walltopo.pipeline.settings import Settings
from walltopo.pipeline.stage import Stage
from walltopo.pipeline.stages import STAGES
from walltopo.pipeline.stages.ingest import INGEST
from walltopo.pipeline.workplace import changed_outputs, input_hash, is_locked
from walltopo.reconstruct.ingest.sources import list_sources
from walltopo.scans.folder import ScanFolder
from walltopo.scans.manifest import Manifest, StageRecord
from walltopo.scans.photos import SourceList

State = Literal["not run", "running", "killed", "done", "failed", "interrupted", "stale", "damaged"]


@dataclass(frozen=True)
class StageHealth:
    """The state of one stage of a scan.

    Parameters
    ----------
    state : "stale" if inputs, settings or code differ from the last run; "damaged" if an output is
        missing or was changed; "killed" if the record says running but no process holds the lock.
        Stages in these states would run again.
    why : explanation of the state, or "".
    record : record of the last run, or None.
    """

    stage: str
    state: State
    why: str
    record: StageRecord | None


def stages_health(folder: ScanFolder, *, verify: bool = False) -> list[StageHealth]:
    """Return the state of each stage, in order.

    Parameters
    ----------
    verify : hash every file, to find damage that did not change sizes and times.

    Raises
    ------
    InputError : `scan.json` is damaged.
    """
    manifest = Manifest.load(folder.manifest)
    hashes = HashCache(folder.work / "hashes.json", trust=not verify)
    try:
        settings = msgspec.convert(manifest.settings, Settings)
    except msgspec.ValidationError:
        settings = None
    sources = [Path(path) for path in manifest.sources]
    found = []
    for stage in STAGES:
        record = manifest.stages.get(stage.name)
        state, why = _state(folder, stage, record, settings, sources, hashes)
        found.append(StageHealth(stage.name, state, why, record))
    return found


def _state(
    folder: ScanFolder,
    stage: Stage,
    record: StageRecord | None,
    settings: Settings | None,
    sources: list[Path],
    hashes: HashCache,
) -> tuple[State, str]:
    if record is None:
        return "not run", ""
    if record.state == "running" and not is_locked(folder):
        return "killed", "the process of this run was killed"
    if record.state != "done":
        return record.state, record.error.strip().splitlines()[-1] if record.error else ""
    changed = changed_outputs(folder, stage, record, hashes)
    if changed:
        names = ", ".join(item.in_folder(folder).name for item in changed)
        return "damaged", f"changed since the stage wrote them: {names}"
    if settings is None:
        return "stale", "its settings are unknown to this version of walltopo"
    problem = _sources_problem(folder, sources, hashes) if stage is INGEST else ""
    if problem:
        return "stale", problem
    fresh = input_hash(folder, stage, settings, hashes) == record.input_hash
    return ("done", "") if fresh else ("stale", "its inputs, settings or code have changed")


def _sources_problem(folder: ScanFolder, given: list[Path], hashes: HashCache) -> str:
    """Return how the user's photos differ from `sources.json`; "" if equal or moved away."""
    if not any(path.exists() for path in given):
        return ""
    try:
        listed = list_sources(given, folder.root, hashes.hash)
        stored = SourceList.load(folder.sources)
        return "" if listed.contents == stored.contents else "the photos have changed"
    except InputError as error:
        return error.message.splitlines()[0]
