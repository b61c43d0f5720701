"""How a scan stands, without running it: which stages are done, stale, damaged or were killed."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import msgspec

from walltopo.core import InputError
from walltopo.pipeline.freshness import changed_outputs, input_hash
from walltopo.pipeline.ledger import Ledger
from walltopo.pipeline.settings import Settings
from walltopo.pipeline.stages import STAGES, Stage
from walltopo.pipeline.workplace import is_held
from walltopo.scans.folder import ScanFolder
from walltopo.scans.manifest import Manifest, StageRecord

__all__ = ["StageHealth", "stages_health"]

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
        names = ", ".join(getattr(folder, name).name for name in changed)
        return "damaged", f"not as the stage left it: {names}"
    if settings is None:
        return "stale", "made with settings that this walltopo does not know"
    moved_away = stage.name == STAGES[0].name and not any(path.exists() for path in sources)
    if moved_away:
        return "done", ""
    try:
        fresh = input_hash(folder, stage, settings, sources, ledger) == record.input_hash
    except InputError as error:  # of the photos' folder
        return "stale", error.message.splitlines()[0]
    return ("done", "") if fresh else ("stale", "what it was made from has changed")
