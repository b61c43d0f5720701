"""What a page of an older walltopo saves, and what relabelled triangles do to the export."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from walltopo.core import EnvironmentLacksError, InputError
from walltopo.export.server.desk import EditsChangedError
from walltopo.export.server.edits import (
    EditDocument,
    edits_version,
    read_old,
    save_edits,
)
from walltopo.export.wall import read_wall
from walltopo.scans.edits import EditLog, Ref, Remove
from walltopo.scans.folder import ScanFolder
from walltopo.scans.holds import Holds
from walltopo.scans.old_edits import HoldEdits, Rename, RouteEdits
from walltopo.scans.relabelled import Relabelled

MakeScan = Callable[..., ScanFolder]
HERE = (1.0, -0.1, 2.0)
HOLD: dict[str, Any] = {"id": 1, "at": HERE}
RENAME: dict[str, Any] = {"route": 1, "at": HERE, "name": "Owl"}


def rename(name: str) -> RouteEdits:
    return RouteEdits(rename=(Rename(route=1, at=HERE, name=name),))


def save(scan: ScanFolder, edits: HoldEdits) -> None:
    """Save as the editor does."""
    document = EditDocument(edits, RouteEdits())
    save_edits(scan, msgspec.to_builtins(document), edits_version(scan))


@settings(deadline=None)
@given(name=st.text(max_size=60))
def test_any_name_survives_toml(tmp_path_factory: pytest.TempPathFactory, name: str) -> None:
    name = name.encode("utf-8", "ignore").decode()
    path = tmp_path_factory.mktemp("edits") / "routes.edits.toml"
    rename(name).save(path)
    assert RouteEdits.load(path) == rename(name)


@pytest.mark.parametrize(
    ("edits", "message"),
    [
        ({"holds": {}, "routes": {"blow": []}}, "blow"),
        ({"holds": {}, "routes": {"assign": [{"hold": 1, "at": HERE}]}}, "`route`"),
        ({"holds": {"holds": [{"id": -1, "at": HERE}]}, "routes": {}}, r"\.id"),
        ({"holds": {"holds": [{"id": 1, "at": [0, 0]}]}, "routes": {}}, r"\.at"),
        ({"holds": {"strokes": 3}, "routes": {}}, "strokes"),
        ({"holds": {}}, "`routes`"),
        ({"holds": {}, "routes": {}, "extra": 1}, "extra"),
        ({"holds": {"holds": [{"id": 1, "at": [0, 1e300, 0]}]}, "routes": {}}, r"\.at"),
        ({"holds": {"holds": [{"id": 1, "at": [0, np.nan, 0]}]}, "routes": {}}, r"\.at"),
        ({"holds": {"holds": [{"id": 10**20, "at": HERE}]}, "routes": {}}, r"\.id"),
        (
            {"holds": {"strokes": [{"hold": 2**31, "at": HERE, "radius_m": 1}]}, "routes": {}},
            "hold",
        ),
        ({"holds": {"holds": [HOLD]}, "routes": {"rename": [RENAME | {"name": "\ud83e"}]}}, "name"),
        ({"holds": {"holds": [HOLD | {"colour": "\udc00"}]}, "routes": {}}, "colour"),
        ({"holds": {"holds": [HOLD] * 50_001}, "routes": {}}, "50000"),
        ({"holds": {}, "routes": {"rename": [RENAME] * 50_001}}, "50000"),
        ({"holds": {}, "routes": {"merge": [{"routes": [1, 2, 3], "at": [HERE] * 2}]}}, "2 places"),
        (
            {"holds": {}, "routes": {"split": [{"route": 1, "holds": [4, 5], "at": [HERE]}]}},
            "2 ids, but `at` has 1 place",
        ),
    ],
)
def test_broken_edits_are_refused_and_nothing_is_written(
    make_scan: MakeScan, edits: Any, message: str
) -> None:
    scan = make_scan(cells=20)
    before = sorted(path.name for path in scan.root.iterdir())
    with pytest.raises(InputError, match=message):
        save_edits(scan, edits, edits_version(scan))
    assert sorted(path.name for path in scan.root.iterdir()) == before


def test_relabelled_triangles_and_removed_holds_reach_the_model(make_scan: MakeScan) -> None:
    scan = make_scan()
    plain = read_wall(scan)
    face = np.flatnonzero(plain.face_instance == 0)[:100].astype(np.int32)
    Relabelled(face, np.full(100, 3, np.int32)).save(scan.relabelled)
    table = Holds.load(scan.holds)
    kept = tuple(row for row in table.holds if row.id != 7)
    msgspec.structs.replace(table, holds=kept).save(scan.holds)
    painted = read_wall(scan)
    assert (painted.face_instance[face] == 3).all()
    assert not (painted.face_instance == 7).any()
    Relabelled(np.array([10**6], np.int32), np.array([3], np.int32)).save(scan.relabelled)
    with pytest.raises(InputError, match="triangle 1000000"):
        read_wall(scan)


@pytest.mark.parametrize("name", ["hold_edits", "route_edits"])
def test_both_files_are_saved_or_none(make_scan: MakeScan, name: str) -> None:
    scan = make_scan(cells=20)
    in_the_way = getattr(scan, name)
    in_the_way.mkdir()
    (in_the_way / "kept.txt").write_text("kept")
    edits = {"holds": {"holds": [HOLD]}, "routes": {"rename": [RENAME]}}
    with pytest.raises(InputError, match="in the way"):
        save_edits(scan, edits, edits_version(scan))
    assert (in_the_way / "kept.txt").read_text() == "kept"
    other = scan.route_edits if name == "hold_edits" else scan.hold_edits
    assert not other.exists()


def test_a_full_disk_between_the_files_saves_none(
    make_scan: MakeScan, monkeypatch: pytest.MonkeyPatch
) -> None:
    scan = make_scan(cells=20)
    save(scan, HoldEdits())
    before = scan.hold_edits.read_bytes()

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(RouteEdits, "save", full)
    with pytest.raises(EnvironmentLacksError, match="no space left"):
        save_edits(scan, {"holds": {"holds": [HOLD]}, "routes": {}}, edits_version(scan))
    assert scan.hold_edits.read_bytes() == before
    assert not list(scan.root.glob(".partial-*"))


def test_of_many_who_save_on_the_same_edits_one_does(make_scan: MakeScan) -> None:
    scan = make_scan(cells=20)
    version = edits_version(scan)
    saved, refused = [], []

    def one(number: int) -> None:
        edits = {"holds": {}, "routes": msgspec.to_builtins(rename(f"route of {number}"))}
        try:
            saved.append((number, save_edits(scan, edits, version)))
        except EditsChangedError:
            refused.append(number)

    threads = [threading.Thread(target=one, args=(k,)) for k in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(saved) == 1
    assert len(refused) == 7
    number, after = saved[0]
    found = read_old(scan)["routes"]["rename"][0]["name"], edits_version(scan)
    assert found == (f"route of {number}", after)


def test_edits_by_hand_count_as_a_change(make_scan: MakeScan) -> None:
    scan = make_scan(cells=20)
    version = edits_version(scan)
    rename("By hand").save(scan.route_edits)
    with pytest.raises(EditsChangedError):
        save_edits(scan, {"holds": {}, "routes": {}}, version)
    assert read_old(scan)["routes"]["rename"][0]["name"] == "By hand"


@pytest.mark.parametrize(
    "text", ["a = " + "[" * 100_000, "version = " + "1" * 5000, "version = 1\nname = '\x00'"]
)
def test_edit_files_that_no_toml_reader_takes(make_scan: MakeScan, text: str) -> None:
    scan = make_scan(cells=20)
    scan.route_edits.write_text(text)
    with pytest.raises(InputError, match="not valid TOML"):
        RouteEdits.load(scan.route_edits)


def test_an_old_page_does_not_replace_newer_edits(make_scan: MakeScan) -> None:
    scan = make_scan(cells=20)
    EditLog(edits=(Remove(hold=Ref(1, HERE)),)).save(scan.edits)
    with pytest.raises(InputError, match="older walltopo"):
        save_edits(scan, {"holds": {}, "routes": {}}, edits_version(scan))
    assert not scan.hold_edits.exists()
