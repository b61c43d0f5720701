"""A wall is shown while its scan runs."""

from __future__ import annotations

import json
import shutil
import threading
import urllib.error
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from walltopo.cli import main
from walltopo.core import InputError
from walltopo.pipeline.first_look import FollowedScan, first_look, scan_status
from walltopo.pipeline.workplace import locked
from walltopo.publish.server.run import Server
from walltopo.scans.folder import ScanFolder
from walltopo.scans.manifest import Manifest


@pytest.fixture
def scan(tiny_scan: Path, tmp_path: Path) -> ScanFolder:
    return ScanFolder(shutil.copytree(tiny_scan, tmp_path / tiny_scan.name))


def stopped_after(scan: ScanFolder, stage: str) -> ScanFolder:
    """The scan as it was when a stage had ended and the next one had begun."""
    manifest = Manifest.load(scan.manifest)
    names = list(manifest.stages)
    for name in names[names.index(stage) + 1 :]:
        record = manifest.stages.pop(name)
        if name == names[names.index(stage) + 1]:
            record.state = "running"
            manifest.stages[name] = record
    manifest.save(scan.manifest)
    scan.page.unlink()
    return scan


def gltf(glb: bytes) -> dict[str, object]:
    length = int.from_bytes(glb[12:16], "little")
    parsed: dict[str, object] = json.loads(glb[20 : 20 + length])
    return parsed


@pytest.mark.parametrize("stage", ["scale", "dense", "texture"])
def test_each_look_is_a_wall_without_holds(scan: ScanFolder, stage: str) -> None:
    stopped_after(scan, stage)
    look = scan_status(scan).look
    assert look.startswith(f"{stage}-")
    document = json.dumps(gltf(first_look(scan, look)))
    assert ('"images"' in document) == (stage == "texture")
    assert ("COLOR_0" in document) == (stage != "texture")
    with pytest.raises(InputError, match="no look"):
        first_look(scan, "routes-1")


def test_the_status_follows_the_run(scan: ScanFolder) -> None:
    done = scan_status(scan)
    assert {stage.state for stage in done.stages} == {"done"}
    assert done.finished
    stopped_after(scan, "dense")
    with locked(scan):
        running = scan_status(scan)
    assert running.running
    states = {stage.name: stage.state for stage in running.stages}
    assert (states["dense"], states["texture"], states["export"]) == ("done", "running", "waiting")
    killed = scan_status(scan)
    assert not killed.running
    assert {s.name: s.state for s in killed.stages}["texture"] == "interrupted"
    manifest = Manifest.load(scan.manifest)
    manifest.stages["texture"].state = "failed"
    manifest.stages["texture"].error = "Traceback\nMemoryError: too large"
    manifest.save(scan.manifest)
    assert scan_status(scan).problem == "MemoryError: too large"


def test_a_scan_that_has_not_placed_photos_has_no_look(scan: ScanFolder) -> None:
    assert scan_status(stopped_after(scan, "ingest")).look == ""


@contextmanager
def followed(scan: ScanFolder) -> Iterator[str]:
    server = Server(scan.root, 0, unfinished=FollowedScan(scan))
    thread = threading.Thread(target=server.run, daemon=True)
    thread.start()
    try:
        yield server.url.rstrip("/")
    finally:
        server.should_exit = True
        thread.join()


def test_the_server_follows_a_scan_until_its_page_is_there(scan: ScanFolder) -> None:
    page = scan.page.read_bytes()
    stopped_after(scan, "dense")
    with followed(scan) as url:
        with urllib.request.urlopen(f"{url}/") as answer:
            assert answer.url == f"{url}/first-look"
            assert "script-src 'self'" in answer.headers["Content-Security-Policy"]
            text = answer.read().decode()
        for script in ("viewer.js", "first_look.js"):
            assert f"/first-look/{script}" in text
            with urllib.request.urlopen(f"{url}/first-look/{script}") as answer:
                assert answer.headers["Content-Type"].startswith("text/javascript")
        with urllib.request.urlopen(f"{url}/first-look/status") as answer:
            status = json.load(answer)
        assert not status["finished"]
        address = f"{url}/first-look/wall.glb?look={status['look']}"
        with urllib.request.urlopen(address) as answer:
            assert gltf(answer.read())["asset"]
        for wrong in ("", "?look=../mesh.ply", "?look=routes-12"):
            with pytest.raises(urllib.error.HTTPError) as refused:
                urllib.request.urlopen(f"{url}/first-look/wall.glb{wrong}")
            assert refused.value.code in (400, 404)
        scan.page.write_bytes(page)
        with urllib.request.urlopen(f"{url}/") as answer:
            assert answer.read() == page


def test_a_scan_without_a_page_is_not_edited(
    scan: ScanFolder, capsys: pytest.CaptureFixture[str]
) -> None:
    stopped_after(scan, "dense")
    assert main(["view", str(scan.root), "--edit"]) == 3
    assert "no page to edit" in capsys.readouterr().err
