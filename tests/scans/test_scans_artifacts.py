"""The table of artifacts against the scan folder: what is missing, damaged or taken away."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any

import pytest

from walltopo.core import InputError
from walltopo.pipeline.stages import STAGES
from walltopo.scans.artifacts import Artifact
from walltopo.scans.folder import ARTIFACTS, ScanFolder
from walltopo.scans.scale import Frame

READ = sorted({item for stage in STAGES for item in stage.reads}, key=lambda item: item.name)
LATE = {"photos", "texture", "given_texture"}  # their pixels are read by who needs them


def test_no_two_artifacts_have_one_path() -> None:
    paths = [item.path for item in ARTIFACTS]
    assert len(set(paths)) == len(paths)


@pytest.mark.parametrize("item", READ, ids=lambda item: item.name)
def test_what_is_missing_names_its_file_and_the_stage_that_makes_it(
    item: Artifact[Any], tmp_path: Path
) -> None:
    folder = ScanFolder(tmp_path)
    if item.optional:
        assert item.load(folder) is None
        return
    with pytest.raises(InputError, match=item.in_folder(folder).name) as caught:
        item.load(folder)
    assert item.made_by in caught.value.hint


@pytest.mark.parametrize(
    "item", [item for item in READ if item.name not in LATE], ids=lambda item: item.name
)
def test_what_is_damaged_names_its_file(item: Artifact[Any], tmp_path: Path) -> None:
    """A file of noise, or a folder without what belongs into it."""
    folder = ScanFolder(tmp_path)
    path = item.in_folder(folder)
    path.parent.mkdir(exist_ok=True)
    if path.suffix:
        path.write_bytes(b"\x00\xff noise")
    else:
        path.mkdir()
    with pytest.raises(InputError, match=path.name):
        item.load(folder)


def test_an_optional_artifact_is_taken_away_by_none(tmp_path: Path) -> None:
    from walltopo.scans.scale import Aligned

    folder = ScanFolder(tmp_path)
    value = Aligned(
        reference="../old",
        align="rigid",
        reference_moved=0.0,
        shared_points=9,
        frame=Frame(True, True, False),
    )
    ScanFolder.aligned.store(folder, value)
    assert ScanFolder.aligned.load(folder) == value
    for _ in range(2):
        ScanFolder.aligned.store(folder, None)
        assert ScanFolder.aligned.load(folder) is None


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pipes among files")
def test_a_pipe_in_place_of_a_file_is_refused(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "holds.json")
    with pytest.raises(InputError, match=r"holds\.json: is a pipe"):
        ScanFolder.holds.load(ScanFolder(tmp_path))
