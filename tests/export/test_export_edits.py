"""Edit files, what they do to the export, and the server that saves them."""

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
from walltopo.export.server.edits import (
    EditDocument,
    EditsChangedError,
    edits_version,
    read_edits,
    save_edits,
)
from walltopo.export.wall import read_wall
from walltopo.scans.attributes import Attributes
from walltopo.scans.folder import ScanFolder
from walltopo.scans.old_edits import HoldEdit, HoldEdits, Rename, RouteEdits, Stroke, apply_strokes

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


def delete_hold(scan: ScanFolder, number: int) -> None:
    """What the classify stage does about a deleted hold: it is not in attributes.json."""
    found = Attributes.load(scan.attributes)
    kept = tuple(hold for hold in found.instances if hold.id != number)
    msgspec.structs.replace(found, instances=kept).save(scan.attributes)


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


def test_strokes_and_deleted_holds_reach_the_model(make_scan: MakeScan) -> None:
    scan = make_scan()
    plain = read_wall(scan)
    x, y, z = plain.mesh.centroids[np.flatnonzero(plain.face_instance == 0)[100]].tolist()
    place = (x, y, z)
    save(scan, HoldEdits(strokes=(Stroke(hold=3, at=place, radius_m=0.2),)))
    delete_hold(scan, 7)
    painted = read_wall(scan)
    near = np.linalg.norm(plain.mesh.centroids - place, axis=1) <= 0.2
    assert (painted.face_instance[near] == 3).all()
    assert not (painted.face_instance == 7).any()


def test_strokes_give_the_model_the_triangles_that_classify_measures(make_scan: MakeScan) -> None:
    scan = make_scan()
    plain = read_wall(scan)
    x, y, z = plain.mesh.centroids[np.flatnonzero(plain.face_instance == 3)[0]].tolist()
    strokes = (
        Stroke(hold=7, at=(x, y, z), radius_m=0.1),  # by a hold that is deleted afterwards
        Stroke(hold=0, at=plain.holds[0].position, radius_m=0.05),
        Stroke(hold=5, at=plain.holds[0].position, radius_m=0.02),
    )
    deleted = HoldEdit(id=7, at=plain.holds[6].position, deleted=True)
    save(scan, HoldEdits(holds=(deleted,), strokes=strokes))
    delete_hold(scan, 7)
    expected = apply_strokes(plain.mesh, plain.face_instance, strokes)
    assert (expected != plain.face_instance).any()
    assert (expected == 7).sum() > (plain.face_instance == 7).sum()
    expected[expected == 7] = 0
    np.testing.assert_array_equal(read_wall(scan).face_instance, expected)


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
    edits, now = read_edits(scan)
    assert (edits["routes"]["rename"][0]["name"], now) == (f"route of {number}", after)


def test_edits_by_hand_count_as_a_change(make_scan: MakeScan) -> None:
    scan = make_scan(cells=20)
    version = edits_version(scan)
    rename("By hand").save(scan.route_edits)
    with pytest.raises(EditsChangedError):
        save_edits(scan, {"holds": {}, "routes": {}}, version)
    assert read_edits(scan)[0]["routes"]["rename"][0]["name"] == "By hand"


@pytest.mark.parametrize(
    "text", ["a = " + "[" * 100_000, "version = " + "1" * 5000, "version = 1\nname = '\x00'"]
)
def test_edit_files_that_no_toml_reader_takes(make_scan: MakeScan, text: str) -> None:
    scan = make_scan(cells=20)
    scan.route_edits.write_text(text)
    with pytest.raises(InputError, match="not valid TOML"):
        RouteEdits.load(scan.route_edits)
