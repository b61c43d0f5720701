"""Outputs that are not as their stage left them are made again, and nothing of others is lost."""

from __future__ import annotations

import json
import os
import shutil
from hashlib import sha256
from pathlib import Path

import msgspec
import pytest

from walltopo.cli import main
from walltopo.core import InputError
from walltopo.core.files import HashCache
from walltopo.pipeline.health import stages_health
from walltopo.pipeline.plan import names_of_plan
from walltopo.pipeline.runner import scan
from walltopo.pipeline.settings import load_settings
from walltopo.pipeline.stages import stage_named
from walltopo.scans.edits import EditLog, Ref, SetRoute
from walltopo.scans.folder import ScanFolder
from walltopo.scans.manifest import Manifest
from walltopo.scans.photos import SourceFile, SourceList

SETTINGS = load_settings(None, ["sparse.threads=1", "texture.size=512"])  # of `tiny_scan`

NAMES = names_of_plan(part=False)


@pytest.fixture
def wall(tiny_scan: Path, tmp_path: Path) -> Path:
    # A photo of the same name, which is part of the outputs.
    return Path(shutil.copytree(tiny_scan, tmp_path / tiny_scan.name))


def outputs(folder: Path) -> list[tuple[str, str]]:
    """(stage, path below the scan) of every file that a stage wrote."""
    scan_folder = ScanFolder(folder)
    found = []
    for stage in NAMES:
        for item in stage_named(stage).writes:
            path = item.in_folder(scan_folder)
            files = sorted(path.rglob("*")) if path.is_dir() else [path] if path.exists() else []
            found += [(stage, str(f.relative_to(folder))) for f in files if f.is_file()]
    return found


def content(folder: Path) -> dict[str, str]:
    """Hashes of every output but the report, which tells times: pytest would draw a picture of how
    large bytes differ, for hours."""
    names = [name for _, name in outputs(folder) if name != "report.html"]
    return {name: sha256((folder / name).read_bytes()).hexdigest() for name in names}


def halve(file: Path) -> None:
    file.write_bytes(file.read_bytes()[: file.stat().st_size // 2])


@pytest.mark.slow
def test_each_damaged_file_is_found(wall: Path) -> None:
    scan([], wall, SETTINGS)
    for stage, name in outputs(wall):
        whole = (wall / name).read_bytes()
        halve(wall / name)
        states = {found.stage: found.state for found in stages_health(ScanFolder(wall))}
        if whole:  # a model of one rig has an empty table or two
            assert states[stage] == "damaged", name
        (wall / name).write_bytes(whole)


@pytest.mark.slow
def test_all_that_is_damaged_is_made_again(tiny_scan: Path, wall: Path) -> None:
    for _, name in outputs(wall):
        halve(wall / name)
    assert scan([], wall, SETTINGS).ran == NAMES
    assert content(wall) == content(tiny_scan)
    assert scan([], wall, SETTINGS).ran == ()


@pytest.mark.slow
def test_nothing_is_made_again_for_what_a_desktop_leaves_behind(wall: Path) -> None:
    for place in (wall / "photos", wall / "page"):
        (place / ".DS_Store").write_bytes(b"\0" * 8)
        (place / "Thumbs.db").write_bytes(b"\0" * 8)
    assert scan([], wall, SETTINGS).ran == ()


def test_a_copy_is_read_once_and_kept(wall: Path) -> None:
    assert scan([], wall, SETTINGS, verify=True).ran == ()


def test_damage_that_left_size_and_times_is_found_by_verify(wall: Path) -> None:
    scan([], wall, SETTINGS)
    table, ledger = wall / "routes.json", wall / "work" / "hashes.json"
    data = bytearray(table.read_bytes())
    data[len(data) // 2] ^= 1
    table.write_bytes(data)
    # A disk that fails changes no time: what is now there looks to the ledger as what was.
    entries = json.loads(ledger.read_text())
    damaged = HashCache(tmp_ledger := wall / "work" / "other.json")
    damaged.hash(table)
    damaged.save()
    entries[str(table)][0] = json.loads(tmp_ledger.read_text())[str(table)][0]
    ledger.write_text(json.dumps(entries))
    assert scan([], wall, SETTINGS).ran == ()
    assert scan([], wall, SETTINGS, verify=True).ran == ("edit",)


def test_what_a_user_put_there_is_kept_aside(wall: Path, tiny_scan: Path) -> None:
    mine = wall / "routes.json"
    mine.write_text('{"routes": "mine"}')
    assert scan([], wall, SETTINGS).ran == ("edit",)
    assert (wall / "set-aside" / "routes.json").read_text() == '{"routes": "mine"}'
    mine.write_text("mine again")
    scan([], wall, SETTINGS)
    assert (wall / "set-aside" / "routes2.json").read_text() == "mine again"
    assert content(wall) == content(tiny_scan)


def test_what_a_user_put_there_can_be_accepted(wall: Path) -> None:
    holds = wall / "routes.json"
    table = json.loads(holds.read_text())
    table["routes"][0]["name"] = "Sloper Troopers"
    holds.write_text(json.dumps(table))
    assert scan([], wall, SETTINGS, accept_changes=True).ran == ("export",)
    assert not (wall / "set-aside").exists()
    assert scan([], wall, SETTINGS).ran == ()
    assert b"Sloper Troopers" in (wall / "wall.glb").read_bytes()


def test_photos_that_cannot_be_made_again_are_reported(wall: Path, tmp_path: Path) -> None:
    moved = os.fsencode(tmp_path / "moved-away.jpg")
    listed = msgspec.json.decode((wall / "sources.json").read_bytes(), type=SourceList)
    files = tuple(SourceFile(moved, item.content) for item in listed.files)
    SourceList(files=files).save(wall / "sources.json")
    manifest = Manifest.load(wall / "scan.json")
    manifest.sources = [str(tmp_path / "moved-away")]
    manifest.save(wall / "scan.json")
    photo = next((wall / "photos").iterdir())
    photo.write_bytes(photo.read_bytes()[:-100])
    with pytest.raises(InputError, match=r"moved-away.jpg was deleted after the scan was made"):
        scan([], wall, SETTINGS)
    assert photo.exists()


def test_the_ledger_is_a_cache(wall: Path) -> None:
    for text in ("", "[]", '{"a": 1}'):
        (wall / "work" / "hashes.json").write_text(text)
        assert scan([], wall, SETTINGS).ran == ()


def test_a_scan_of_an_older_walltopo_is_adopted(wall: Path) -> None:
    data = json.loads((wall / "scan.json").read_text())
    for record in data["stages"].values():
        del record["outputs"]
    (wall / "scan.json").write_text(json.dumps(data))
    assert scan([], wall, SETTINGS).ran == ()
    (wall / "routes.json").unlink()
    assert scan([], wall, SETTINGS).ran == ("edit",)


def test_status_tells_how_the_stages_stand(
    wall: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    scan([], wall, SETTINGS)
    assert main(["status", str(wall)]) == 0
    (wall / "wall.glb").write_bytes(b"glTF")
    EditLog(edits=(SetRoute(route=Ref(1), name="new"),)).save(wall / "edits.json")
    manifest = Manifest.load(wall / "scan.json")
    manifest.stages["lift"].state = "running"
    manifest.save(wall / "scan.json")
    states = {found.stage: found.state for found in stages_health(ScanFolder(wall))}
    assert states["dense"] == "done"
    assert states["lift"] == "killed"
    assert states["edit"] == "stale"
    assert states["export"] == "damaged"
    assert main(["status", str(wall)]) == 1
    assert "wall.glb" in capsys.readouterr().out


def test_times_alone_make_nothing_again(wall: Path) -> None:
    scan([], wall, SETTINGS)
    for path in wall.rglob("*"):
        os.utime(path, (0, 0))
    assert scan([], wall, SETTINGS).ran == ()
