"""Stages declare all artifacts with the right types, in order, and get no others."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from pathlib import Path
from typing import Any, get_type_hints

import pytest

from walltopo.core import InputError
from walltopo.pipeline.runner import run_stage
from walltopo.pipeline.settings import Settings
from walltopo.pipeline.stage import Stage
from walltopo.pipeline.stages import STAGES
from walltopo.scans.artifacts import Context, artifacts_of, figures, of
from walltopo.scans.folder import ARTIFACTS, ScanFolder
from walltopo.scans.manifest import Metrics
from walltopo.scans.photos import Photo, PhotoList

each_stage = pytest.mark.parametrize("stage", STAGES, ids=[stage.name for stage in STAGES])


@each_stage
def test_a_stage_is_a_function_of_what_it_declares(stage: Stage) -> None:
    assert get_type_hints(stage.run) == {
        "reads": stage.reads_type,
        "settings": type(getattr(Settings(), stage.name)),
        "context": Context,
        "return": stage.writes_type,
    }


@each_stage
def test_each_field_has_the_name_of_its_artifact(stage: Stage) -> None:
    for declared in (stage.reads_type, stage.writes_type):
        names = [field.name for field in dataclasses.fields(declared) if field.name != "metrics"]
        assert names == [name for name, _ in artifacts_of(declared)]
        assert names == [item.name for _, item in artifacts_of(declared)]


def test_every_artifact_is_made_once_and_before_it_is_read() -> None:
    made = {item for item in ARTIFACTS if not item.made_by}
    for stage in STAGES:
        assert made.issuperset(stage.reads), f"{stage.name} reads what nobody made before it"
        assert made.isdisjoint(stage.writes)
        assert all(item.made_by == stage.name for item in stage.writes)
        made.update(stage.writes)
    assert made == set(ARTIFACTS)


@dataclass(frozen=True)
class Reads:
    photo_list: PhotoList = of(ScanFolder.photo_list)


@dataclass(frozen=True)
class Writes:
    metrics: Metrics = figures()


Calls = list[tuple[Reads, Context]]


def small(calls: Calls) -> Stage:
    """A stage that notes what it was given in each run."""

    def run(reads: Reads, settings: Any, context: Context) -> Writes:
        calls.append((reads, context))
        return Writes({"photos": len(reads.photo_list.photos)})

    return Stage("small", Reads, Writes, run)


def test_a_stage_cannot_read_what_it_does_not_declare(tmp_path: Path) -> None:
    calls: Calls = []
    scan = ScanFolder(tmp_path)
    photos = PhotoList(photos=(Photo("a.jpg", 640, 480, None, "a.jpg", 1.0),))
    photos.save(scan.photo_list)
    # Files that it does not declare are there, and broken: nobody looks at them.
    for path in (scan.mesh, scan.holds, scan.edits):
        path.write_text("broken")
    assert run_stage(scan, small(calls), None) == {"photos": 1}
    ((reads, context),) = calls
    assert reads == Reads(photos)
    for name in {item.name for item in ARTIFACTS} - {"photo_list"}:
        assert not hasattr(reads, name)
        assert not hasattr(context, name)
    values = [getattr(context, field.name) for field in dataclasses.fields(context)]
    assert not any(isinstance(value, ScanFolder) for value in values)
    assert scan.root not in values
    assert not context.scratch.exists(), "gone after the stage"


def test_what_it_declares_must_be_there_and_whole(tmp_path: Path) -> None:
    calls: Calls = []
    scan = ScanFolder(tmp_path)
    with pytest.raises(InputError, match="ingest"):
        run_stage(scan, small(calls), None)
    scan.photo_list.write_text('{"version": 1, "photos": [{"name": 7}]}')
    with pytest.raises(InputError, match=r"photos\.json.*name"):
        run_stage(scan, small(calls), None)
    assert not calls
