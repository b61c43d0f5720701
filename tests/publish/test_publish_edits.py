"""Relabelled triangles and removed holds appear in the export."""

from __future__ import annotations

from collections.abc import Callable

import msgspec
import numpy as np
import pytest

from walltopo.core import InputError
from walltopo.publish.wall_data import read_wall
from walltopo.scans.folder import ScanFolder
from walltopo.scans.holds import Holds
from walltopo.scans.instances import Relabelled

MakeScan = Callable[..., ScanFolder]


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
