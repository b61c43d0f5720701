"""The table of artifacts against the scan folder and the contracts of the stages."""

from __future__ import annotations

import importlib
import typing
from pathlib import Path
from typing import Any

import pytest

from walltopo.core import InputError
from walltopo.pipeline.stages import SOURCES, STAGES, Stage, stage_names
from walltopo.scans.artifacts import ARTIFACTS, load_artifact, store_artifact
from walltopo.scans.edits import HoldEdits, RouteEdits
from walltopo.scans.folder import ScanFolder
from walltopo.scans.manifest import Metrics
from walltopo.scans.scale import Frame

READ = sorted({name for stage in STAGES for name in stage.reads})
LATE = {"photos", "texture"}  # their pixels are read by who needs them
MADE = [name for name, artifact in ARTIFACTS.items() if artifact.made_by]


def resolved(target: str) -> Any:
    module, _, name = target.partition(":")
    return getattr(importlib.import_module(module), name)


def expected(name: str) -> Any:
    """The type that a contract must give a field."""
    kind = resolved(ARTIFACTS[name].type)
    return kind | None if ARTIFACTS[name].optional else kind


def test_the_table_names_the_paths_of_a_scan_and_no_others() -> None:
    folder = ScanFolder("scan")
    names = {name for name, value in vars(ScanFolder).items() if isinstance(value, property)}
    assert set(ARTIFACTS) == names - {"manifest", "work"}
    paths = [getattr(folder, name) for name in ARTIFACTS]
    assert len(set(paths)) == len(paths)
    assert all(path.is_relative_to("scan") for path in paths)


@pytest.mark.parametrize("stage", STAGES, ids=stage_names())
def test_contracts_have_the_types_of_the_table(stage: Stage) -> None:
    for part in (stage.contract.Reads, stage.contract.Writes):
        hints = typing.get_type_hints(part)
        assert hints.pop("metrics", Metrics) == Metrics
        hints.pop(SOURCES, None)
        assert hints == {name: expected(name) for name in hints}


def test_every_artifact_is_made_by_its_stage_before_it_is_read() -> None:
    there = {name for name in ARTIFACTS if name not in MADE}
    for stage in STAGES:
        assert set(stage.reads) <= there, stage.name
        assert {name for name in MADE if ARTIFACTS[name].made_by == stage.name} == set(stage.writes)
        there |= set(stage.writes)
    assert there == set(ARTIFACTS)


@pytest.mark.parametrize("name", READ)
def test_what_is_missing_names_its_file_and_the_stage_that_makes_it(
    name: str, tmp_path: Path
) -> None:
    folder, artifact = ScanFolder(tmp_path), ARTIFACTS[name]
    if artifact.optional:
        assert load_artifact(folder, name) is None
    elif artifact.made_by:
        with pytest.raises(InputError, match=getattr(folder, name).name) as caught:
            load_artifact(folder, name)
        assert artifact.made_by in caught.value.hint
    else:
        assert load_artifact(folder, name) in (HoldEdits(), RouteEdits())


@pytest.mark.parametrize("name", [name for name in READ if name not in LATE])
def test_what_is_damaged_names_its_file(name: str, tmp_path: Path) -> None:
    """A file of noise, or a folder without what belongs into it."""
    folder = ScanFolder(tmp_path)
    path: Path = getattr(folder, name)
    path.parent.mkdir(exist_ok=True)
    if path.suffix:
        path.write_bytes(b"\x00\xff noise")
    else:
        path.mkdir()
    with pytest.raises(InputError, match=path.name):
        load_artifact(folder, name)


def test_an_optional_artifact_is_taken_away_by_none(tmp_path: Path) -> None:
    from walltopo.scans.aligned import Aligned

    folder = ScanFolder(tmp_path)
    value = Aligned(
        reference="../old", align="rigid", reference_moved=0.0, shared_points=9,
        frame=Frame(True, True, False),
    )  # fmt: skip
    store_artifact(folder, "aligned", value)
    assert load_artifact(folder, "aligned") == value
    for _ in range(2):
        store_artifact(folder, "aligned", None)
        assert load_artifact(folder, "aligned") is None
