"""The table of artifacts against the scan folder: what is missing, damaged or taken away."""

from __future__ import annotations

from pathlib import Path

import pytest

from walltopo.core import InputError
from walltopo.pipeline.stages import STAGES
from walltopo.scans.artifacts import ARTIFACTS, load_artifact, store_artifact
from walltopo.scans.folder import ScanFolder
from walltopo.scans.old_edits import HoldEdits, RouteEdits
from walltopo.scans.scale import Frame

READ = sorted({name for stage in STAGES for name in stage.reads})
LATE = {"photos", "texture"}  # their pixels are read by who needs them


def test_the_table_names_the_paths_of_a_scan_and_no_others() -> None:
    folder = ScanFolder("scan")
    names = {name for name, value in vars(ScanFolder).items() if isinstance(value, property)}
    assert set(ARTIFACTS) == names - {"manifest", "work"}
    paths = [getattr(folder, name) for name in ARTIFACTS]
    assert len(set(paths)) == len(paths)
    assert all(path.is_relative_to("scan") for path in paths)


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
