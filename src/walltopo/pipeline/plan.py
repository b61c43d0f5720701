"""The plan of a scan: which stages it has, and in which folder each of them works.

The photos of a partial rescan are scanned for themselves, in the folder `part/` of the scan. Its
stage `join` makes the whole wall of that part and the reference; the stages after it continue with
the whole wall. Other scans have no such stage.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from walltopo.core import InputError
from walltopo.pipeline.settings import Settings
from walltopo.pipeline.stage import Stage
from walltopo.pipeline.stages import STAGES, stage_index
from walltopo.pipeline.stages.edit import EDIT
from walltopo.pipeline.stages.join import JOIN, PART, REFERENCE
from walltopo.scans.folder import ScanFolder
from walltopo.scans.manifest import Manifest


@dataclass(frozen=True)
class Step:
    """One stage of a scan.

    Parameters
    ----------
    folder : the folder in which the stage's artifacts lie.
    others : other scans of which the stage reads artifacts, by name.
    """

    stage: Stage
    folder: ScanFolder
    others: Mapping[str, ScanFolder] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """Return the name of the stage."""
        return self.stage.name

    @property
    def reads(self) -> Iterator[Path]:
        """Yield the path of each artifact that the stage reads."""
        for item in self.stage.reads:
            yield item.in_folder(self.folder)
        for scan, item in self.stage.reads_elsewhere:
            yield item.in_folder(self.others[scan])

    @property
    def writes(self) -> Iterator[Path]:
        """Yield the path of each artifact that the stage writes."""
        for item in self.stage.writes:
            yield item.in_folder(self.folder)


Plan = tuple[Step, ...]


def plan_of(folder: ScanFolder, settings: Settings, manifest: Manifest) -> Plan:
    """Return the steps of a scan, in order.

    Raises
    ------
    InputError : the scan is a partial rescan, and the settings are not those of one.
    """
    if manifest.joined is not None:
        # An older walltopo joined it in place: the files of the part alone are gone.
        return tuple(Step(stage, folder) for stage in STAGES[stage_index(EDIT.name) :])
    if settings.sparse.part:
        return tuple(_steps_of_part(folder, ScanFolder(settings.sparse.reference)))
    if JOIN.name in manifest.stages:
        raise InputError(
            f"{folder.root}: is a partial rescan, and the settings do not say so",
            "Give --reference and --part again, or scan the photos into a new folder.",
        )
    return tuple(Step(stage, folder) for stage in STAGES if stage is not JOIN)


def _steps_of_part(folder: ScanFolder, reference: ScanFolder) -> Iterator[Step]:
    joins = stage_index(JOIN.name)
    for stage in STAGES[:joins]:
        yield Step(stage, folder.part)
    yield Step(JOIN, folder, {PART: folder.part, REFERENCE: reference})
    for stage in STAGES[joins + 1 :]:
        yield Step(stage, folder)


def names_of_plan(*, part: bool) -> tuple[str, ...]:
    """Return the names of a scan's stages, in order; `part`: of a partial rescan."""
    return tuple(stage.name for stage in STAGES if part or stage is not JOIN)


def check_stages(from_stage: str | None, to_stage: str | None) -> None:
    """Check the stages that a user named.

    Raises
    ------
    InputError : a stage is unknown, or they are in the wrong order.
    """
    first = stage_index(from_stage) if from_stage is not None else 0
    last = stage_index(to_stage) if to_stage is not None else len(STAGES) - 1
    if first > last:
        raise InputError(f"--from {from_stage} comes after --to {to_stage}")


def select_steps(
    plan: Plan, folder: ScanFolder, from_stage: str | None, to_stage: str | None, force: bool
) -> tuple[Sequence[Step], Sequence[Step]]:
    """Return the steps of a run, and those of them that run even if they are up to date.

    Raises
    ------
    InputError : an older walltopo joined the scan with its reference, so the first stage cannot
        run again.
    """
    last = len(STAGES) - 1 if to_stage is None else stage_index(to_stage)
    first = 0 if force else len(STAGES) if from_stage is None else stage_index(from_stage)
    if first < stage_index(plan[0].name):
        raise _joined_error(folder, f"{STAGES[first].name} cannot run again")
    chosen = [step for step in plan if stage_index(step.name) <= last]
    return chosen, [step for step in chosen if stage_index(step.name) >= first]


def check_steps(steps: Sequence[Step], settings: Settings) -> None:
    """Check before a run what its stages need.

    Raises
    ------
    EnvironmentLacksError : this machine lacks what a stage needs.
    SettingsError, InputError : see `check_colours`.
    """
    from walltopo.pipeline.partial.colours import check_colours

    for step in steps:
        step.stage.check(step.stage.settings_of(settings))
        if step.stage is JOIN:
            check_colours(settings)


def fixed_photos_error(folder: ScanFolder) -> InputError:
    """Return the error for other photos of a scan whose plan has no `ingest`."""
    return _joined_error(folder, "its photos cannot change")


def _joined_error(folder: ScanFolder, why: str) -> InputError:
    return InputError(
        f"{folder.root}: is a partial rescan that an older walltopo joined with its reference, so "
        f"{why}",
        "Scan the photos into a new folder.",
    )
