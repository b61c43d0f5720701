"""Run a scan's stages in order, and resume a run.

A stage runs if its inputs, settings or code version differ from its last finished run, if an output
is missing or changed, or if the caller forces it. Inputs are compared by content, so a rerun that
produces the same file does not trigger the stages after it.
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
from types import MappingProxyType
from typing import Any, Protocol

import msgspec

from walltopo.core import InputError, Progress, Silent, WalltopoError
from walltopo.core.files import HashCache, as_text, explain_full_disk, hash_path
from walltopo.core.memory import peak_mb, reset_peak
from walltopo.pipeline.forecast import Forecast, photos_of
from walltopo.pipeline.plan import (
    Plan,
    Step,
    check_stages,
    check_steps,
    fixed_photos_error,
    plan_of,
    select_steps,
)
from walltopo.pipeline.renewals import renew_inputs
from walltopo.pipeline.settings import Settings
from walltopo.pipeline.stage import Stage
from walltopo.pipeline.stages import stage_named
from walltopo.pipeline.stages.ingest import INGEST
from walltopo.pipeline.warm_up import warming_up
from walltopo.pipeline.workplace import (
    InputHash,
    changed_outputs,
    input_hash,
    locked,
    outputs_of,
    set_aside,
)
from walltopo.reconstruct.ingest.sources import find_sources, is_video, list_sources
from walltopo.scans.artifacts import (
    Context,
    Load,
    artifacts_of,
    load_artifact,
    load_bundle,
)
from walltopo.scans.folder import ScanFolder
from walltopo.scans.manifest import Manifest, Metrics, StageRecord
from walltopo.scans.photos import SourceList
from walltopo.scans.poses import GivenPoses


class Listener(Progress, Protocol):
    """A `Progress` that also receives the forecast, and the start and end of each stage."""

    def scan_begins(self, forecast: Forecast) -> None: ...
    def stage_begins(self, stage: str) -> None: ...
    def stage_ends(self, stage: str, record: StageRecord) -> None: ...
    def stage_kept(self, stage: str, record: StageRecord) -> None: ...


class _SilentListener(Silent):
    def scan_begins(self, forecast: Forecast) -> None: ...
    def stage_begins(self, stage: str) -> None: ...
    def stage_ends(self, stage: str, record: StageRecord) -> None: ...
    def stage_kept(self, stage: str, record: StageRecord) -> None: ...


@dataclass(frozen=True)
class ScanResult:
    """The scan folder, and the metrics of each stage.

    Parameters
    ----------
    folder : the scan folder.
    metrics : metrics by stage name.
    ran : stages that were computed in this run; the others were up to date.
    """

    folder: ScanFolder
    metrics: dict[str, Metrics]
    ran: tuple[str, ...] = field(default=())


def scan(
    photos: Sequence[Path | str] | Path | str,
    out: Path | str,
    settings: Settings | None = None,
    *,
    add: bool = False,
    from_stage: str | None = None,
    to_stage: str | None = None,
    force: bool = False,
    verify: bool = False,
    accept_changes: bool = False,
    listener: Listener | None = None,
) -> ScanResult:
    """Run the stages of a scan that are missing, stale or changed.

    Parameters
    ----------
    photos : folder, video or photo files; may be empty for an ingested scan.
    out : scan folder; created if it does not exist.
    settings : see `load_settings`; None: defaults.
    add : `photos` come to those that the scan has, instead of replacing them.
    from_stage : first stage that runs even if it is up to date, with all stages after it.
    to_stage : last stage to run.
    force : run every stage.
    verify : hash every file, to find damage that did not change sizes and times.
    accept_changes : keep outputs that were changed from outside, instead of recomputing them.
    listener : receives the progress.

    Raises
    ------
    InputError : `out` is not a scan folder, a stage name is unknown, or the photos are unusable.
    EnvironmentLacksError : `out` cannot be written, or another run holds its lock.
    """
    given = [photos] if isinstance(photos, (str, Path)) else list(photos)
    settings = settings or Settings()
    listener = listener or _SilentListener()
    folder = ScanFolder(out)
    check_stages(from_stage, to_stage)
    with locked(folder):
        manifest = Manifest.load(folder.manifest)
        manifest.walltopo = version("walltopo")
        sources = [Path(p).absolute() for p in given] or [Path(p) for p in manifest.sources]
        if add:
            sources = _with_earlier(sources, folder, manifest)
        if not sources:
            raise InputError(f"{folder.root}: no photos given, and none were ingested before")
        plan = plan_of(folder, settings, manifest)
        chosen, forced = select_steps(plan, folder, from_stage, to_stage, force)
        hashes = HashCache(folder.work / "hashes.json", trust=not verify)
        new = not folder.manifest.exists()
        if new:  # check all stages before anything is written
            check_steps(chosen, settings)
        runner = _Runner(folder, manifest, settings, sources, listener, hashes, accept_changes)
        _write_user_files(plan[0], folder, sources, settings, hashes)
        due = runner.due(chosen, forced)
        if not new:
            check_steps(due, settings)
        listener.scan_begins(runner.forecast(due))
        # A run that makes a mesh needs most kernels; a scan with a mesh has compiled most before.
        compiling = any(step.name == "dense" for step in due)
        try:
            with warming_up() if compiling else nullcontext():
                for step in chosen:
                    runner.run(step, step in forced)
        finally:
            # The hash cache only saves time, so it may fail. A folder without a scan stays empty.
            if folder.manifest.exists():
                with suppress(WalltopoError):
                    hashes.save()
        metrics = {name: record.metrics for name, record in manifest.stages.items()}
        return ScanResult(folder, metrics, tuple(runner.ran))


def _with_earlier(given: Sequence[Path], folder: ScanFolder, manifest: Manifest) -> list[Path]:
    """Return the photos that a scan was made of, and further ones.

    Raises
    ------
    InputError : there is no scan yet, or its photos were moved away.
    """
    earlier = [Path(path) for path in manifest.sources]
    if not earlier:
        raise InputError(
            f"{folder.root}: no scan to add photos to", "Scan them without --add first."
        )
    missing = [path for path in earlier if not path.exists()]
    if missing:
        raise InputError(
            f"{missing[0]}: photos of this scan were here, and are gone",
            "To add photos, the earlier ones must still be where they were.",
        )
    return list(dict.fromkeys([*earlier, *given]))


def _write_user_files(
    first: Step,
    folder: ScanFolder,
    sources: Sequence[Path],
    settings: Settings,
    hashes: HashCache,
) -> None:
    """Write what the first stage reads: the list of photos, and their poses.

    Raises
    ------
    InputError : photos or poses are unusable; or the plan has no `ingest`, and the photos are
        others.
    """
    if first.name != INGEST.name:
        if any(path.exists() for path in sources):
            listed = list_sources(sources, folder.root, hashes.hash)
            if listed.content_hash != SourceList.fingerprint(folder.sources):
                raise fixed_photos_error(folder)
        return
    poses = given_poses(first.folder, sources, settings.sparse.poses)
    write_sources(first.folder, sources, hashes, folder)
    write_poses(first.folder, poses)


def write_sources(
    folder: ScanFolder,
    given: Sequence[Path],
    hashes: HashCache | None = None,
    scan: ScanFolder | None = None,
) -> None:
    """Write `sources.json`; if the photos were moved away, the old list stays.

    Parameters
    ----------
    scan : the scan that `folder` is a part of, in which no photos may lie; None: `folder` itself.
    """
    if folder.sources.exists() and not any(path.exists() for path in given):
        return
    own = (scan or folder).root
    listed = list_sources(given, own, hashes.hash if hashes else hash_path)
    folder.root.mkdir(exist_ok=True)
    listed.save(folder.sources)


def given_poses(folder: ScanFolder, photos: Sequence[Path], setting: str) -> GivenPoses | None:
    """Return the poses of the setting `sparse.poses`, None without one.

    If poses or photos were moved away, the poses that were read before stay.

    Parameters
    ----------
    photos : folders and files of the user.

    Raises
    ------
    InputError : the poses are missing, damaged or not of the photos.
    """
    from walltopo.reconstruct.poses.formats import read_poses

    if not setting:
        return None
    moved = not Path(setting).exists() or not any(path.exists() for path in photos)
    if moved and folder.poses.exists():
        return GivenPoses.load(folder.poses)
    files = find_sources(photos, folder.root).files
    return read_poses(Path(setting), [file for file in files if not is_video(file)])


def write_poses(folder: ScanFolder, poses: GivenPoses | None) -> None:
    """Write `poses.json` if it changed; remove it without poses."""
    if poses is None:
        folder.poses.unlink(missing_ok=True)
    elif not folder.poses.exists() or GivenPoses.load(folder.poses) != poses:
        poses.save(folder.poses)


def stored_settings(folder: ScanFolder) -> Settings:
    """Return the settings by which a scan was made.

    Raises
    ------
    InputError : the settings are unknown to this version of walltopo.
    """
    return _settings_in(Manifest.load(folder.manifest), folder)


def _settings_in(manifest: Manifest, folder: ScanFolder) -> Settings:
    try:
        return msgspec.convert(manifest.settings, Settings)
    except msgspec.ValidationError as error:
        raise InputError(
            f"{folder.manifest}: its settings are unknown to this version of walltopo: {error}",
            f"Run `walltopo scan -o {folder.root}` once.",
        ) from error


def stored_plan(folder: ScanFolder) -> Plan:
    """Return the steps of a scan by its stored settings.

    Raises
    ------
    InputError : the settings are unknown to this version of walltopo.
    """
    manifest = Manifest.load(folder.manifest)
    return plan_of(folder, _settings_in(manifest, folder), manifest)


def stale_stages(folder: ScanFolder, names: Sequence[str]) -> list[str]:
    """Return which of some stages were run before and would run again."""
    runner = _stored_runner(folder, load_artifact)
    known = [step for step in runner.steps(names) if step.name in runner.manifest.stages]
    return [step.name for step in runner.due(known, [])]


def refresh(folder: ScanFolder, names: Sequence[str], load: Load = load_artifact) -> list[str]:
    """Run some stages if they are stale; return the names of those that ran.

    The caller must hold the folder's lock (`workplace.locked`).

    Raises
    ------
    InputError : an input is missing or damaged, or the settings are unknown.
    """
    runner = _stored_runner(folder, load)
    try:
        for step in runner.steps(names):
            runner.run(step, forced=False)
    finally:
        with suppress(WalltopoError):
            runner.hashes.save()
    return runner.ran


def _stored_runner(folder: ScanFolder, load: Load) -> _Runner:
    """Return a runner with the stored settings and photos of a scan."""
    manifest = Manifest.load(folder.manifest)
    sources = [Path(path) for path in manifest.sources]
    hashes = HashCache(folder.work / "hashes.json")
    return _Runner(
        folder,
        manifest,
        _settings_in(manifest, folder),
        sources,
        _SilentListener(),
        hashes,
        load=load,
    )


class _Runner:
    """Runs the stages of one scan folder."""

    def __init__(
        self,
        folder: ScanFolder,
        manifest: Manifest,
        settings: Settings,
        sources: Sequence[Path],
        listener: Listener,
        hashes: HashCache,
        accept_changes: bool = False,
        load: Load = load_artifact,
    ) -> None:
        self.folder, self.manifest, self.settings = folder, manifest, settings
        self.sources, self.listener, self.hashes = sources, listener, hashes
        self.accept_changes = accept_changes
        self.load = load
        self.ran: list[str] = []

    def steps(self, names: Sequence[str]) -> list[Step]:
        """Return the steps of some stages; a stage that the scan does not have is left out."""
        plan = plan_of(self.folder, self.settings, self.manifest)
        return [step for step in plan if step.name in names]

    def due(self, steps: Sequence[Step], forced: Sequence[Step]) -> list[Step]:
        """Return the steps that will probably run.

        The list is an upper bound: a stage with unchanged outputs does not trigger later stages.
        """
        found: list[Step] = []
        changed: set[Path] = set()
        for step in steps:
            record = self.manifest.stages.get(step.name)
            if not (
                step in forced
                or record is None
                or record.state != "done"
                or changed.intersection(step.reads)
                or record.input_hash != self._inputs(step).hash
                or changed_outputs(step, record, self.hashes)
            ):
                continue
            found.append(step)
            changed.update(step.writes)
        return found

    def forecast(self, steps: Sequence[Step]) -> Forecast:
        """Return the forecast of some steps."""
        before = dict(self.manifest.stages)
        photos = photos_of(before)
        for step in steps:
            if step.stage is INGEST:
                with suppress(InputError):  # the run itself reports the error
                    files = [item.file for item in ScanFolder.sources.load(step.folder).files]
                    photos = None if any(map(is_video, files)) else len(files)
        return Forecast([step.name for step in steps], photos, before)

    def run(self, step: Step, forced: bool) -> None:
        """Run one stage if it is forced or stale, and record the result."""
        renew_inputs(step, self.listener)
        inputs = self._inputs(step)
        record = self.manifest.stages.get(step.name)
        if record is not None and record.state == "done":
            fresh = record.input_hash == inputs.hash and not forced
            if self._outputs_valid(step, record, accept=fresh and self.accept_changes) and fresh:
                self.listener.stage_kept(step.name, record)
                return
        self.manifest.settings = self.settings.as_dict()
        self.manifest.sources = [as_text(path) for path in self.sources]
        record = StageRecord("running", input_hash=inputs.hash, elsewhere=inputs.elsewhere)
        self._save_record(step, record)
        self.listener.stage_begins(step.name)
        started = time.monotonic()
        reset_peak()
        try:
            record.metrics = self._run_stage(step)
            record.outputs = outputs_of(step, self.hashes)
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
            self._save_record(step, record)
            self.listener.stage_ends(step.name, record)
        self.ran.append(step.name)

    def _save_record(self, step: Step, record: StageRecord) -> None:
        self.manifest.stages[step.name] = record
        self.manifest.save(self.folder.manifest)

    def _run_stage(self, step: Step) -> Metrics:
        return run_stage(
            step.folder,
            step.stage,
            step.stage.settings_of(self.settings),
            self.listener,
            records=self.manifest.stages,
            load=self.load,
            others=step.others,
        )

    def _inputs(self, step: Step) -> InputHash:
        """Return the hash of everything that determines the stage's outputs."""
        return input_hash(step, self.settings, self.hashes, self.manifest.stages.get(step.name))

    def _outputs_valid(self, step: Step, record: StageRecord, accept: bool) -> bool:
        """Return whether the outputs are unchanged, or are accepted as they are.

        Files that were changed from outside are moved to `set-aside/`, so that no work is lost.
        """
        changed = changed_outputs(step, record, self.hashes)
        present = [item for item in changed if item.in_folder(step.folder).exists()]
        if accept and changed and changed == present:
            record.outputs = outputs_of(step, self.hashes)
            self._save_record(step, record)
            return True
        if present:  # move files away only if they can be recomputed
            load_bundle(step.folder, step.stage.reads_type, self.load, step.others)
        for item in changed:
            path = item.in_folder(step.folder)
            if item not in present:
                self.listener.note(f"{path.name} is missing: {step.name} runs again")
                continue
            kept = set_aside(self.folder, path)
            self.listener.note(
                f"{path.name} was changed since {step.name} wrote it: recomputing it (the changed "
                f"file is now {kept.relative_to(self.folder.root)})"
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
    others: Mapping[str, ScanFolder] = MappingProxyType({}),
) -> Metrics:
    """Load the inputs of one stage, run it and store its outputs; return its metrics.

    Parameters
    ----------
    settings : the stage's settings section.
    records : records of earlier stages, for the report.
    load : loads an artifact of a scan.
    others : other scans that the stage reads, by name.

    Raises
    ------
    InputError : an input is missing or damaged; the stage may raise further errors.
    """
    stage = stage_named(stage) if isinstance(stage, str) else stage
    reads = load_bundle(folder, stage.reads_type, load, others)
    folder.work.mkdir(parents=True, exist_ok=True)
    # The scratch folder is on the scan's disk, so that outputs are moved by a rename.
    with (
        explain_full_disk(folder.root),
        tempfile.TemporaryDirectory(prefix=".partial-", dir=folder.root) as scratch,
    ):
        context = Context(
            scratch=Path(scratch),
            cache=folder.work,
            progress=progress or Silent(),
            title=as_text(folder.root.resolve().name),
            records=records or {},
        )
        outputs = stage.run(reads, settings, context)
        for name, item in artifacts_of(stage.writes_type):
            item.store(folder, getattr(outputs, name))
    metrics: Metrics = outputs.metrics
    return metrics
