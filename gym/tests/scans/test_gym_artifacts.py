"""The files of a scan in the store are those of the folder."""

from __future__ import annotations

from pathlib import Path
from uuid import uuid4

import pytest
from gym.tests.worlds import World

from walltopo.pipeline.runner import stored_plan
from walltopo.scans.folder import ScanFolder
from walltopo.scans.manifest import Manifest
from walltopo_gym.scans.artifacts import download_scan, upload_stage


@pytest.mark.parametrize("name", ["hidden.json", "relabelled.npz"])
def test_a_file_that_an_edit_no_longer_writes_is_dropped(
    world: World, tmp_path: Path, name: str
) -> None:
    store, scan, folder = world.server.services.store, uuid4(), ScanFolder(tmp_path / "scan")
    folder.root.mkdir()
    Manifest.load(folder.manifest).save(folder.manifest)
    assert folder.root / name in next(s for s in stored_plan(folder) if s.name == "edit").writes
    folder.holds.write_text("{}")
    (folder.root / name).write_bytes(b"of the first edit")
    upload_stage(store, scan, folder, "edit")
    (folder.root / name).unlink()
    upload_stage(store, scan, folder, "edit")
    elsewhere = ScanFolder(tmp_path / "elsewhere")
    download_scan(store, scan, elsewhere)
    assert elsewhere.holds.read_text() == "{}"
    assert not (elsewhere.root / name).exists()
