"""What stages declare: complete, in order, of the right types; and that they get nothing else."""

from __future__ import annotations

import dataclasses
import importlib
import sys
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any, get_type_hints

import pytest

from walltopo.core import InputError
from walltopo.pipeline.runner import run_stage
from walltopo.pipeline.settings import Settings
from walltopo.pipeline.stages import SOURCES, STAGES, Stage
from walltopo.scans.artifacts import ARTIFACTS
from walltopo.scans.context import Context
from walltopo.scans.folder import ScanFolder
from walltopo.scans.manifest import Metrics
from walltopo.scans.photo_list import Photo, PhotoList

each_stage = pytest.mark.parametrize("stage", STAGES, ids=[stage.name for stage in STAGES])


@each_stage
def test_a_stage_is_a_function_of_what_it_declares(stage: Stage) -> None:
    run = importlib.import_module(f"{stage.room}.stage").run
    assert get_type_hints(run) == {
        "reads": stage.contract.Reads,
        "settings": type(getattr(Settings(), stage.name)),
        "context": Context,
        "return": stage.contract.Writes,
    }


@each_stage
def test_what_it_declares_has_the_types_of_the_artifacts(stage: Stage) -> None:
    for declared in (stage.contract.Reads, stage.contract.Writes):
        hints = get_type_hints(declared)
        assert (hints.pop("metrics", None) == Metrics) is (declared is stage.contract.Writes)
        assert (hints.pop(SOURCES, None) is not None) is (
            stage is STAGES[0] and declared is stage.contract.Reads
        )
        for name, hint in hints.items():
            module, _, kind = ARTIFACTS[name].type.partition(":")
            value = getattr(importlib.import_module(module), kind)
            assert hint == (value | None if ARTIFACTS[name].optional else value), name


def test_every_artifact_is_made_once_and_before_it_is_read() -> None:
    made: set[str] = {name for name, artifact in ARTIFACTS.items() if not artifact.made_by}
    for stage in STAGES:
        assert set(stage.reads) <= made, f"{stage.name} reads what nobody made before it"
        assert not made & set(stage.writes)
        assert all(ARTIFACTS[name].made_by == stage.name for name in stage.writes)
        made |= set(stage.writes)
    assert made == set(ARTIFACTS)


@dataclass(frozen=True)
class Reads:
    photo_list: PhotoList


@dataclass(frozen=True)
class Writes:
    metrics: Metrics


@pytest.fixture
def given(monkeypatch: pytest.MonkeyPatch) -> list[tuple[Any, Context]]:
    """What the stage of a room called `small` was given in each run."""
    calls: list[tuple[Any, Context]] = []

    def run(reads: Reads, settings: Any, context: Context) -> Writes:
        calls.append((reads, context))
        return Writes({"photos": len(reads.photo_list.photos)})

    contract, stage = ModuleType("small.contract"), ModuleType("small.stage")
    vars(contract).update(Reads=Reads, Writes=Writes)
    vars(stage).update(run=run)
    for module in (contract, stage):
        monkeypatch.setitem(sys.modules, module.__name__, module)
    return calls


def test_a_stage_cannot_read_what_it_does_not_declare(
    given: list[tuple[Any, Context]], tmp_path: Path
) -> None:
    scan = ScanFolder(tmp_path)
    photos = PhotoList(photos=(Photo("a.jpg", 640, 480, None, "a.jpg", 1.0),))
    photos.save(scan.photo_list)
    # Files that it does not declare are there, and broken: nobody looks at them.
    for path in (scan.mesh, scan.attributes, scan.route_edits):
        path.write_text("broken")
    assert run_stage(scan, Stage("small", "small"), None) == {"photos": 1}
    ((reads, context),) = given
    assert reads == Reads(photos)
    for name in ARTIFACTS.keys() - {"photo_list"}:
        assert not hasattr(reads, name)
        assert not hasattr(context, name)
    values = [getattr(context, field.name) for field in dataclasses.fields(context)]
    assert not any(isinstance(value, ScanFolder) for value in values)
    assert scan.root not in values
    assert not context.scratch.exists(), "gone after the stage"


def test_what_it_declares_must_be_there_and_whole(
    given: list[tuple[Any, Context]], tmp_path: Path
) -> None:
    scan = ScanFolder(tmp_path)
    with pytest.raises(InputError, match="ingest"):
        run_stage(scan, Stage("small", "small"), None)
    scan.photo_list.write_text('{"version": 1, "photos": [{"name": 7}]}')
    with pytest.raises(InputError, match=r"photos\.json.*name"):
        run_stage(scan, Stage("small", "small"), None)
    assert not given
