"""Stages declare all artifacts with the right types, in order, and get no others."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from pathlib import Path
from typing import Any, get_type_hints

import pytest

from walltopo.core import InputError
from walltopo.core.files import HashCache
from walltopo.pipeline.plan import Step, plan_of
from walltopo.pipeline.runner import run_stage
from walltopo.pipeline.settings import Settings
from walltopo.pipeline.stage import Stage
from walltopo.pipeline.stages import STAGES, stage_named
from walltopo.pipeline.workplace import input_hash
from walltopo.reconstruct.settings import SparseSettings
from walltopo.scans.artifacts import Context, artifacts_of, figures, of, scan_of, scans_of
from walltopo.scans.folder import ARTIFACTS, ScanFolder
from walltopo.scans.manifest import Manifest, Metrics, StageRecord
from walltopo.scans.photos import Photo, PhotoList

each_stage = pytest.mark.parametrize("stage", STAGES, ids=[stage.name for stage in STAGES])


@each_stage
def test_a_stage_is_a_function_of_what_it_declares(stage: Stage) -> None:
    assert get_type_hints(stage.run) == {
        "reads": stage.reads_type,
        "settings": type(stage.settings_of(Settings())),
        "context": Context,
        "return": stage.writes_type,
    }


@each_stage
def test_each_field_has_the_name_of_its_artifact(stage: Stage) -> None:
    for declared in (stage.reads_type, stage.writes_type):
        others = {name: bundle for name, _, bundle in scans_of(declared)}
        for bundle in (declared, *others.values()):
            names = [field.name for field in dataclasses.fields(bundle) if field.name != "metrics"]
            own = [name for name in names if bundle is not declared or name not in others]
            assert own == [name for name, _ in artifacts_of(bundle)]
            assert own == [item.name for _, item in artifacts_of(bundle)]


def test_every_artifact_has_a_stage_that_makes_it() -> None:
    assert all(item in stage_named(item.made_by).writes for item in ARTIFACTS if item.made_by)


WHOLE, PART = Settings(), Settings(sparse=SparseSettings(reference="wall", part=True))


@pytest.mark.parametrize("settings", [WHOLE, PART], ids=["whole", "part"])
def test_every_file_is_made_once_and_before_it_is_read(settings: Settings) -> None:
    scan, reference = ScanFolder("scan"), ScanFolder("wall")
    plan = plan_of(scan, settings, Manifest.load(scan.manifest))
    names = {step.name for step in plan}
    made = {item.in_folder(reference) for item in ARTIFACTS}
    for folder in (scan, scan.part):
        by_users = (item for item in ARTIFACTS if not item.made_by)
        absent = (item for item in ARTIFACTS if item.optional and item.made_by not in names)
        made.update(item.in_folder(folder) for item in (*by_users, *absent))
    for step in plan:
        assert made.issuperset(step.reads), f"{step.name} reads what nobody made before it"
        assert made.isdisjoint(step.writes)
        made.update(step.writes)
    assert {item.in_folder(scan) for item in ARTIFACTS if "work" not in item.path} <= made


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


@dataclass(frozen=True)
class ReadsOther:
    other: Reads = scan_of(Reads, "other")


def test_another_scan_is_read_as_long_as_it_is_there(tmp_path: Path) -> None:
    scan, other = ScanFolder(tmp_path / "scan"), ScanFolder(tmp_path / "other")
    stage = Stage("small", ReadsOther, Writes, lambda *_: Writes({}), section="sparse")
    step = Step(stage, scan, {"other": other})
    hashes = HashCache(tmp_path / "hashes.json", trust=False)
    other.root.mkdir()
    absent = input_hash(step, Settings(), hashes, None)
    PhotoList(photos=(Photo("a.jpg", 640, 480, None, "a.jpg", 1.0),)).save(other.photo_list)
    first = input_hash(step, Settings(), hashes, None)
    assert first.hash != absent.hash
    record = StageRecord("done", input_hash=first.hash, elsewhere=first.elsewhere)
    other.photo_list.unlink()
    assert input_hash(step, Settings(), hashes, record).hash == absent.hash
    # Without the other scan, its files count as they were.
    other.root.rmdir()
    assert input_hash(step, Settings(), hashes, record) == first


def test_what_it_declares_must_be_there_and_whole(tmp_path: Path) -> None:
    calls: Calls = []
    scan = ScanFolder(tmp_path)
    with pytest.raises(InputError, match="ingest"):
        run_stage(scan, small(calls), None)
    scan.photo_list.write_text('{"version": 1, "photos": [{"name": 7}]}')
    with pytest.raises(InputError, match=r"photos\.json.*name"):
        run_stage(scan, small(calls), None)
    assert not calls
