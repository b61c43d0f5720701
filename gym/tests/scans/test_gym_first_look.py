"""A setter sees the wall while its scan runs."""

from __future__ import annotations

import logging
import shutil
from pathlib import Path
from uuid import UUID

import pytest
from gym.tests.worlds import World

from walltopo.scans.folder import ScanFolder
from walltopo.scans.manifest import Manifest
from walltopo_gym.scans.first_looks import drop_first_look, store_first_look


@pytest.fixture
def running(tiny_scan: Path, tmp_path: Path) -> ScanFolder:
    """The folder of a scan whose mesh is done."""
    scan = ScanFolder(shutil.copytree(tiny_scan, tmp_path / "scan"))
    manifest = Manifest.load(scan.manifest)
    for stage in ("texture", "export"):
        del manifest.stages[stage]
    manifest.save(scan.manifest)
    scan.page.unlink()
    return scan


def test_a_running_scan_is_shown_as_far_as_it_is_known(world: World, running: ScanFolder) -> None:
    store, scan, setter = world.server.services.store, world.scan(usable=3), world.people["setter"]
    path = f"{world.path}/scans/{scan}/first-look"
    assert world.server.ask("GET", path, setter).status_code == 204
    store_first_look(store, UUID(str(scan)), running, "sparse")
    assert world.server.ask("GET", path, setter).status_code == 204
    store_first_look(store, UUID(str(scan)), running, "dense")
    shown = world.server.ask("GET", path, setter)
    assert shown.status_code == 200
    assert shown.headers["content-type"] == "model/gltf-binary"
    assert shown.content[:4] == b"glTF"
    assert not (running.work / "first-look.glb").exists()
    headers = {"if-none-match": shown.headers["etag"]}
    assert world.server.ask("GET", path, setter, headers=headers).status_code == 304
    assert world.server.ask("GET", path, world.people["member"]).status_code == 403
    drop_first_look(store, UUID(str(scan)))
    assert world.server.ask("GET", path, setter).status_code == 204


def test_a_look_that_fails_stops_no_scan(
    world: World, running: ScanFolder, caplog: pytest.LogCaptureFixture
) -> None:
    running.mesh.write_bytes(b"no mesh")
    scan = world.scan(usable=3)
    with caplog.at_level(logging.WARNING):
        store_first_look(world.server.services.store, UUID(str(scan)), running, "dense")
    assert "no look after dense" in caplog.text
    setter = world.people["setter"]
    path = f"{world.path}/scans/{scan}/first-look"
    assert world.server.ask("GET", path, setter).status_code == 204
