"""The two files of edits before the log, and what relabelled triangles do to the export."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from walltopo.core import InputError
from walltopo.export.wall import read_wall
from walltopo.scans.document import parse
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


class Both(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    holds: HoldEdits
    routes: RouteEdits


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
def test_broken_entries_are_refused(edits: Any, message: str) -> None:
    with pytest.raises(InputError, match=message):
        parse(edits, Both, "edits")


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


@pytest.mark.parametrize(
    "text", ["a = " + "[" * 100_000, "version = " + "1" * 5000, "version = 1\nname = '\x00'"]
)
def test_edit_files_that_no_toml_reader_takes(make_scan: MakeScan, text: str) -> None:
    scan = make_scan(cells=20)
    scan.route_edits.write_text(text)
    with pytest.raises(InputError, match="not valid TOML"):
        RouteEdits.load(scan.route_edits)
