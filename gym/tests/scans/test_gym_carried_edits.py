"""The edits that a partial rescan carried over from its reference, in the platform's editor."""

from __future__ import annotations

import json
from pathlib import Path
from uuid import UUID

import msgspec
from gym.tests.worlds import World

from walltopo.scans.edits import EditLog, Ref, Remove
from walltopo.scans.folder import ScanFolder
from walltopo.scans.holds import Holds
from walltopo_gym.editing.service import EditLogTable
from walltopo_gym.scans.artifacts import download_files


def _part(world: World, tiny_scan: Path, log: EditLog, path: Path) -> UUID:
    """A partial rescan in review, with a carried log."""
    part = world.finished(tiny_scan, part=True)
    log.save(path)
    world.server.services.store.put(f"scans/{part}/work/carried-edits.json", path)
    return part


def test_the_editor_begins_with_them(world: World, tiny_scan: Path, tmp_path: Path) -> None:
    hold = Holds.load(ScanFolder(tiny_scan).holds).holds[0]
    carried = EditLog(edits=(Remove(hold=Ref(hold.id, hold.position)),))
    part = _part(world, tiny_scan, carried, tmp_path / "carried.json")
    path, setter = f"{world.path}/scans/{part}/editor/log", world.people["setter"]
    before = world.server.ask("GET", path, setter).json()
    assert before == {"version": "0", "edits": json.loads(msgspec.json.encode(carried))}
    tried = world.server.ask("POST", f"{path}/try", setter, {"edits": before["edits"]}).json()
    assert next(row for row in tried["result"]["holds"] if row["id"] == hold.id)["left_out"]
    # The editor has opened the scan's folder by now.
    assert world.server.ask("GET", path, setter).json() == before


def test_a_saved_log_replaces_them(world: World, tiny_scan: Path, tmp_path: Path) -> None:
    folder, carried = ScanFolder(tmp_path / "scan"), EditLog(edits=(Remove(hold=Ref(1)),))
    part = _part(world, tiny_scan, carried, tmp_path / "carried.json")
    download_files(world.server.services.store, part, folder, folder.manifest, folder.carried)
    table = EditLogTable(part, folder, world.server.database)
    assert table.read() == (carried, "0")
    assert table.copy_to_folder() == "0"
    assert not folder.edits.exists()
    assert table.save(EditLog(), "0") == "1"
    assert table.read() == (EditLog(), "1")
    assert table.copy_to_folder() == "1"
    assert EditLog.load(folder.edits) == EditLog()
