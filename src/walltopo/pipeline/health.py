"""Report the state of a scan without running it."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import msgspec

from walltopo.core import InputError
from walltopo.core.files import HashCache
from walltopo.pipeline.plan import Step, plan_of
from walltopo.pipeline.settings import Settings
from walltopo.pipeline.stages.ingest import INGEST
from walltopo.pipeline.stages.join import JOIN
from walltopo.pipeline.workplace import changed_outputs, input_hash, is_locked
from walltopo.reconstruct.ingest.sources import list_sources
from walltopo.reconstruct.settings import SparseSettings
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
    return _Examiner(folder, verify).health()


class _Examiner:
    """Looks at the stages of one scan."""

    def __init__(self, folder: ScanFolder, verify: bool) -> None:
        self._folder = folder
        self._manifest = Manifest.load(folder.manifest)
        self._hashes = HashCache(folder.work / "hashes.json", trust=not verify)
        self._settings: Settings | None = None
        with suppress(msgspec.ValidationError):
            self._settings = msgspec.convert(self._manifest.settings, Settings)

    def health(self) -> list[StageHealth]:
        """Return the state of each stage."""
        settings = self._settings
        if settings is None:  # their kind alone matters here
            part = JOIN.name in self._manifest.stages
            settings = Settings(sparse=SparseSettings(reference="unknown" * part, part=part))
        plan = plan_of(self._folder, settings, self._manifest)
        # Earlier stages of a scan that an older walltopo joined in place are no steps.
        steps = {step.name for step in plan}
        past = [
            StageHealth(name, record.state, "", record)
            for name, record in self._manifest.stages.items()
            if name not in steps
        ]
        return past + [self._health(step) for step in plan]

    def _health(self, step: Step) -> StageHealth:
        record = self._manifest.stages.get(step.name)
        if record is None:
            return StageHealth(step.name, "not run", "", None)
        return StageHealth(step.name, *self._state(step, record), record)

    def _state(self, step: Step, record: StageRecord) -> tuple[State, str]:
        if record.state == "running" and not is_locked(self._folder):
            return "killed", "the process of this run was killed"
        if record.state != "done":
            return record.state, record.error.strip().splitlines()[-1] if record.error else ""
        changed = changed_outputs(step, record, self._hashes)
        if changed:
            names = ", ".join(item.in_folder(step.folder).name for item in changed)
            return "damaged", f"changed since the stage wrote them: {names}"
        if self._settings is None:
            return "stale", "its settings are unknown to this version of walltopo"
        problem = self._sources_problem(step) if step.stage is INGEST else ""
        if problem:
            return "stale", problem
        inputs = input_hash(step, self._settings, self._hashes, record)
        fresh = inputs.hash == record.input_hash
        return ("done", "") if fresh else ("stale", "its inputs, settings or code have changed")

    def _sources_problem(self, step: Step) -> str:
        """Return how the user's photos differ from `sources.json`; "" if equal or moved away."""
        given = [Path(path) for path in self._manifest.sources]
        if not any(path.exists() for path in given):
            return ""
        try:
            listed = list_sources(given, self._folder.root, self._hashes.hash)
            stored = SourceList.load(step.folder.sources)
            return "" if listed.contents == stored.contents else "the photos have changed"
        except InputError as error:
            return error.message.splitlines()[0]
