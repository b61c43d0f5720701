"""The scan: its stages in order, what each reads and writes, and how a run resumes.

A stage runs when its inputs, its settings or its code version differ from those of its last
finished run, when an output is missing or is not what it left, or when asked to. Inputs are
compared by content, so a rerun that produces the same file does not trigger the stages after it.
"""

from __future__ import annotations

import tempfile
import time
import traceback
from collections.abc import Mapping, Sequence
from contextlib import nullcontext, suppress
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path
from typing import Any, Protocol

import msgspec

from walltopo.core import InputError, Progress, Silent, WalltopoError
from walltopo.core.files import as_text, hash_path, told_when_full
from walltopo.core.hashes import Ledger
from walltopo.pipeline.forecast import Forecast, photos_of
from walltopo.pipeline.freshness import changed_outputs, input_hash, outputs_of
from walltopo.pipeline.memory import peak_mb, reset_peak
from walltopo.pipeline.settings import Settings
from walltopo.pipeline.stage import Stage
from walltopo.pipeline.stages import STAGES, stage_index, stage_named
from walltopo.pipeline.stages.ingest import INGEST
from walltopo.pipeline.warm_up import warming_up
from walltopo.pipeline.workplace import held, set_aside
from walltopo.reconstruct.ingest.sources import is_video, list_sources
from walltopo.scans.artifacts import Artifact, Load, artifacts_of, load_artifact, load_bundle
from walltopo.scans.context import Context
from walltopo.scans.folder import ScanFolder
from walltopo.scans.manifest import Manifest, Metrics, StageRecord


class Listener(Progress, Protocol):
    """A `Progress` that is also told how long it may take, and when stages begin and end."""

    def scan_begins(self, forecast: Forecast) -> None: ...
    def stage_begins(self, stage: str) -> None: ...
    def stage_ends(self, stage: str, record: StageRecord) -> None: ...
    def stage_kept(self, stage: str, record: StageRecord) -> None: ...


class _Quiet(Silent):
    def scan_begins(self, forecast: Forecast) -> None: ...
    def stage_begins(self, stage: str) -> None: ...
    def stage_ends(self, stage: str, record: StageRecord) -> None: ...
    def stage_kept(self, stage: str, record: StageRecord) -> None: ...


@dataclass(frozen=True)
class ScanResult:
    """Where the scan lies, and what each stage said.

    Parameters
    ----------
    folder : the scan folder.
    metrics : stage name to its figures.
    ran : the stages that were computed in this run; the others were up to date.
    """

    folder: ScanFolder
    metrics: dict[str, Metrics]
    ran: tuple[str, ...] = field(default=())


def scan(
    photos: Sequence[Path | str] | Path | str,
    out: Path | str,
    settings: Settings | None = None,
    *,
    from_stage: str | None = None,
    to_stage: str | None = None,
    force: bool = False,
    verify: bool = False,
    accept_changes: bool = False,
    listener: Listener | None = None,
) -> ScanResult:
    """Run the stages that are missing, stale or changed.

    Parameters
    ----------
    photos : a folder, a video, or photo files; may be empty for a scan that has been ingested.
    out : the scan folder; created if it does not exist.
    settings : see `load_settings`; defaults where None.
    from_stage : this stage and all after it run even if they are up to date.
    to_stage : the last stage to run.
    force : run every stage.
    verify : read every file, to find also the damage that left size and times as they were.
    accept_changes : take outputs that others changed as they are, rather than make them again.
    listener : told of progress.

    Raises
    ------
    InputError : `out` is not a scan folder, a stage name is unknown, the photos are unusable.
    EnvironmentLacksError : `out` cannot be written, or another run is at work on it.
    """
    given = [photos] if isinstance(photos, (str, Path)) else list(photos)
    chosen = _chosen(from_stage, to_stage)
    settings = settings or Settings()
    listener = listener or _Quiet()
    folder = ScanFolder(out)
    with held(folder):
        manifest = Manifest.load(folder.manifest)
        manifest.walltopo = version("walltopo")
        sources = [Path(p).absolute() for p in given] or [Path(p) for p in manifest.sources]
        if not sources:
            raise InputError(f"{folder.root}: no photos given, and none were ingested before")
        ledger = Ledger(folder.work / "hashes.json", trust=not verify)
        new = not folder.manifest.exists()
        if new:  # all stages are due, and nothing is written where one could not run
            _check(chosen, settings)
        note_sources(folder, sources, ledger)
        runner = _Runner(folder, manifest, settings, sources, listener, ledger, accept_changes)
        first = 0 if force else len(STAGES) if from_stage is None else stage_index(from_stage)
        forced = [stage for stage in chosen if stage_index(stage.name) >= first]
        due = runner.due(chosen, forced)
        if not new:
            _check(due, settings)
        listener.scan_begins(runner.forecast(due))
        # Whoever has a mesh to make calls most kernels later; whoever has one knows most already.
        compiling = any(stage.name == "dense" for stage in due)
        try:
            with warming_up() if compiling else nullcontext():
                for stage in chosen:
                    runner.run(stage, stage in forced)
        finally:
            # A cache: without it the next run reads more. A folder that is no scan yet stays empty.
            if folder.manifest.exists():
                with suppress(WalltopoError):
                    ledger.save()
        metrics = {name: record.metrics for name, record in manifest.stages.items()}
        return ScanResult(folder, metrics, tuple(runner.ran))


def _check(stages: Sequence[Stage], settings: Settings) -> None:
    """Raise what a stage would lack on this machine."""
    for stage in stages:
        stage.check(getattr(settings, stage.name))


def note_sources(folder: ScanFolder, given: Sequence[Path], ledger: Ledger | None = None) -> None:
    """Write `sources.json`; where the photos were moved away since, the old list stays."""
    if folder.sources.exists() and not any(path.exists() for path in given):
        return
    listed = list_sources(given, folder.root, ledger.hash if ledger else hash_path)
    folder.root.mkdir(exist_ok=True)
    listed.save(folder.sources)


def kept_settings(folder: ScanFolder) -> Settings:
    """The settings that a scan was made with.

    Raises
    ------
    InputError : this walltopo does not know them.
    """
    try:
        return msgspec.convert(Manifest.load(folder.manifest).settings, Settings)
    except msgspec.ValidationError as error:
        raise InputError(
            f"{folder.manifest}: made with settings that this walltopo does not know: {error}",
            f"Run `walltopo scan -o {folder.root}` once.",
        ) from error


def stale_stages(folder: ScanFolder, names: Sequence[str]) -> list[str]:
    """Those of some stages that were run before and would run again."""
    runner = _kept_runner(folder, load_artifact)
    stages = [stage_named(name) for name in names]
    known = [stage for stage in stages if stage.name in runner.manifest.stages]
    return [stage.name for stage in runner.due(known, [])]


def refresh(folder: ScanFolder, names: Sequence[str], load: Load = load_artifact) -> list[str]:
    """Run some stages where they must be run, and no other; the names of those that ran.

    Who calls it holds the folder (`workplace.held`).

    Raises
    ------
    InputError : what they read is missing or damaged, or the settings are unknown.
    """
    runner = _kept_runner(folder, load)
    try:
        for name in names:
            runner.run(stage_named(name), forced=False)
    finally:
        with suppress(WalltopoError):
            runner.ledger.save()
    return runner.ran


def _kept_runner(folder: ScanFolder, load: Load) -> _Runner:
    """A runner with the settings and the photos that a scan was made with."""
    manifest = Manifest.load(folder.manifest)
    sources = [Path(path) for path in manifest.sources]
    ledger = Ledger(folder.work / "hashes.json")
    return _Runner(folder, manifest, kept_settings(folder), sources, _Quiet(), ledger, load=load)


class _Runner:
    """One pass over the stages of one folder."""

    def __init__(
        self,
        folder: ScanFolder,
        manifest: Manifest,
        settings: Settings,
        sources: Sequence[Path],
        listener: Listener,
        ledger: Ledger,
        accept_changes: bool = False,
        load: Load = load_artifact,
    ) -> None:
        self.folder, self.manifest, self.settings = folder, manifest, settings
        self.sources, self.listener, self.ledger = sources, listener, ledger
        self.accept_changes = accept_changes
        self.load = load
        self.ran: list[str] = []

    def due(self, stages: Sequence[Stage], forced: Sequence[Stage]) -> list[Stage]:
        """The stages that will probably run; one that makes what it made before stops the rest."""
        found: list[Stage] = []
        changed: set[Artifact[Any]] = set()
        for stage in stages:
            record = self.manifest.stages.get(stage.name)
            if not (
                stage in forced
                or record is None
                or record.state != "done"
                or changed.intersection(stage.reads)
                or record.input_hash != self._inputs(stage)
                or changed_outputs(self.folder, stage, record, self.ledger)
            ):
                continue
            found.append(stage)
            changed.update(stage.writes)
        return found

    def forecast(self, stages: Sequence[Stage]) -> Forecast:
        """How long these will take."""
        names = [stage.name for stage in stages]
        before = dict(self.manifest.stages)
        photos = photos_of(before)
        if INGEST in stages:
            with suppress(InputError):  # the run says it
                files = [item.file for item in ScanFolder.sources.load(self.folder).files]
                photos = None if any(map(is_video, files)) else len(files)
        return Forecast(names, photos, before)

    def run(self, stage: Stage, forced: bool) -> None:
        """Run one stage if it must be run, and record how it went."""
        inputs = self._inputs(stage)
        record = self.manifest.stages.get(stage.name)
        if record is not None and record.state == "done":
            fresh = record.input_hash == inputs and not forced
            if self._is_whole(stage, record, accept=fresh and self.accept_changes) and fresh:
                self.listener.stage_kept(stage.name, record)
                return
        self.manifest.settings = self.settings.as_dict()
        self.manifest.sources = [as_text(path) for path in self.sources]
        record = StageRecord("running", input_hash=inputs)
        self._put(stage, record)
        self.listener.stage_begins(stage.name)
        started = time.monotonic()
        reset_peak()
        try:
            record.metrics = self._call(stage)
            record.outputs = outputs_of(self.folder, stage, self.ledger)
            record.state = "done"
        except KeyboardInterrupt:
            record.state = "interrupted"
            raise
        except WalltopoError as error:
            record.state, record.error = "failed", str(error)
            raise
        except Exception:
            record.state, record.error = "failed", traceback.format_exc()
            raise
        finally:
            record.seconds = round(time.monotonic() - started, 2)
            record.peak_mb = round(peak_mb(), 1)
            self._record(stage, record)
        self.ran.append(stage.name)

    def _record(self, stage: Stage, record: StageRecord) -> None:
        self._put(stage, record)
        self.listener.stage_ends(stage.name, record)

    def _put(self, stage: Stage, record: StageRecord) -> None:
        self.manifest.stages[stage.name] = record
        self.manifest.save(self.folder.manifest)

    def _call(self, stage: Stage) -> Metrics:
        return run_stage(
            self.folder,
            stage,
            getattr(self.settings, stage.name),
            self.listener,
            records=self.manifest.stages,
            load=self.load,
        )

    def _inputs(self, stage: Stage) -> str:
        """The hash of what the stage's outputs would follow from."""
        return input_hash(self.folder, stage, self.settings, self.ledger)

    def _is_whole(self, stage: Stage, record: StageRecord, accept: bool) -> bool:
        """Whether the outputs are as the stage left them, or are accepted as they are.

        What others changed is kept aside, so that nothing is lost that we did not write.
        """
        changed = changed_outputs(self.folder, stage, record, self.ledger)
        present = [item for item in changed if item.in_folder(self.folder).exists()]
        if accept and changed and changed == present:
            record.outputs = outputs_of(self.folder, stage, self.ledger)
            self._put(stage, record)
            return True
        if present:  # nothing is moved away that cannot be made again
            load_bundle(self.folder, stage.reads_type, self.load)
        for item in changed:
            path = item.in_folder(self.folder)
            if item not in present:
                self.listener.note(f"{path.name} is gone: {stage.name} makes it again")
                continue
            kept = set_aside(self.folder, path)
            self.listener.note(
                f"{path.name} is not as {stage.name} left it: made again (what was there is now "
                f"{kept.relative_to(self.folder.root)})"
            )
        return not changed


def run_stage(
    folder: ScanFolder,
    stage: Stage | str,
    settings: Any,
    progress: Progress | None = None,
    *,
    records: Mapping[str, StageRecord] | None = None,
    load: Load = load_artifact,
) -> Metrics:
    """Load what one stage declares, run it, store what it returns; its figures.

    Parameters
    ----------
    settings : the stage's section.
    records : what the stages said before, for the report.
    load : gives the value of an artifact of a scan.

    Raises
    ------
    InputError : something that the stage reads is missing or damaged; and whatever it raises.
    """
    stage = stage_named(stage) if isinstance(stage, str) else stage
    reads = load_bundle(folder, stage.reads_type, load)
    folder.work.mkdir(parents=True, exist_ok=True)
    # On the scan's own disk, so that what is made there moves into place by a rename.
    with (
        told_when_full(folder.root),
        tempfile.TemporaryDirectory(prefix=".partial-", dir=folder.root) as scratch,
    ):
        context = Context(
            scratch=Path(scratch),
            cache=folder.work,
            progress=progress or Silent(),
            title=as_text(folder.root.resolve().name),
            records=records or {},
        )
        made = stage.run(reads, settings, context)
        for name, item in artifacts_of(stage.writes_type):
            item.store(folder, getattr(made, name))
    metrics: Metrics = made.metrics
    return metrics


def _chosen(from_stage: str | None, to_stage: str | None) -> Sequence[Stage]:
    """All stages up to `to_stage`: those before `from_stage` run only if they must."""
    first = stage_index(from_stage) if from_stage is not None else 0
    last = stage_index(to_stage) if to_stage is not None else len(STAGES) - 1
    if first > last:
        raise InputError(f"--from {from_stage} comes after --to {to_stage}")
    return STAGES[: last + 1]
