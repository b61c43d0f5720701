"""How a scan stands, without running it: which stages are done, stale, damaged or were killed."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import msgspec

from walltopo.core import InputError
from walltopo.core.hashes import Ledger
from walltopo.pipeline.freshness import changed_outputs, input_hash
from walltopo.pipeline.settings import Settings
from walltopo.pipeline.stage import Stage
from walltopo.pipeline.stages import STAGES
from walltopo.pipeline.stages.ingest import INGEST
from walltopo.pipeline.workplace import is_held
from walltopo.reconstruct.ingest.sources import list_sources
from walltopo.scans.folder import ScanFolder
from walltopo.scans.manifest import Manifest, StageRecord
from walltopo.scans.sources import SourceList

State = Literal["not run", "running", "killed", "done", "failed", "interrupted", "stale", "damaged"]


@dataclass(frozen=True)
class StageHealth:
    """One stage of a scan.

    Parameters
    ----------
    state : "stale" where its inputs, settings or code are not those of its last run; "damaged"
        where an output is missing or is not as the stage left it; "killed" where it was running
        and nobody is at work. Both would run again.
    why : in words, where the state needs them.
    record : its last run, None where there was none.
    """

    stage: str
    state: State
    why: str
    record: StageRecord | None


def stages_health(folder: ScanFolder, *, verify: bool = False) -> list[StageHealth]:
    """The state of each stage, in order.

    Parameters
    ----------
    verify : read every file, to find also the damage that left size and times as they were.

    Raises
    ------
    InputError : `scan.json` is damaged.
    """
    manifest = Manifest.load(folder.manifest)
    ledger = Ledger(folder.work / "hashes.json", trust=not verify)
    try:
        settings = msgspec.convert(manifest.settings, Settings)
    except msgspec.ValidationError:
        settings = None
    sources = [Path(path) for path in manifest.sources]
    found = []
    for stage in STAGES:
        record = manifest.stages.get(stage.name)
        state, why = _state(folder, stage, record, settings, sources, ledger)
        found.append(StageHealth(stage.name, state, why, record))
    return found


def _state(
    folder: ScanFolder,
    stage: Stage,
    record: StageRecord | None,
    settings: Settings | None,
    sources: list[Path],
    ledger: Ledger,
) -> tuple[State, str]:
    if record is None:
        return "not run", ""
    if record.state == "running" and not is_held(folder):
        return "killed", "the run that was at it ended without a word"
    if record.state != "done":
        return record.state, record.error.strip().splitlines()[-1] if record.error else ""
    changed = changed_outputs(folder, stage, record, ledger)
    if changed:
        names = ", ".join(item.in_folder(folder).name for item in changed)
        return "damaged", f"not as the stage left it: {names}"
    if settings is None:
        return "stale", "made with settings that this walltopo does not know"
    problem = _sources_problem(folder, sources, ledger) if stage is INGEST else ""
    if problem:
        return "stale", problem
    fresh = input_hash(folder, stage, settings, ledger) == record.input_hash
    return ("done", "") if fresh else ("stale", "what it was made from has changed")


def _sources_problem(folder: ScanFolder, given: list[Path], ledger: Ledger) -> str:
    """Say how the user's photos differ from `sources.json`; "" where they do not, or are gone."""
    if not any(path.exists() for path in given):
        return ""
    try:
        listed = list_sources(given, folder.root, ledger.hash)
        known = SourceList.load(folder.sources)
        return "" if listed.contents == known.contents else "the photos have changed"
    except InputError as error:
        return error.message.splitlines()[0]
