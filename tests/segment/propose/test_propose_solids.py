"""Volumes that no mask shows are found by their shape."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from tests.geometry.test_panels import sheet

from walltopo.core import Mesh, Silent
from walltopo.scans.detections import Detections
from walltopo.scans.instances import InstanceRecord, InstanceRecords, InstanceTable
from walltopo.scans.photos import PhotoSet
from walltopo.segment.propose.proposals import propose
from walltopo.segment.propose.solids import EVIDENCE
from walltopo.segment.settings import ProposeSettings

CELL = 0.02
CLASSES = {"1": "hold", "2": "volume"}
AT = (1.2, 1.0)


def wall(height: float = 0.2, half: float = 0.3) -> NDArray[np.float64]:
    """Return (101, 121) heights of a wall of 2.4 m x 2 m with a pyramid in the middle."""
    z, x = np.mgrid[:101, :121] * CELL
    away = np.maximum(abs(x - AT[0]), abs(z - AT[1]))
    noise = np.random.default_rng(0).normal(0, 0.0005, x.shape)
    return np.maximum(0.0, height * (1 - away / half)) + noise


def near(mesh: Mesh, radius: float) -> NDArray[np.bool_]:
    across = np.abs(mesh.centroids[:, [0, 2]] - AT)
    return np.asarray(across.max(axis=1) < radius)


def proposed(
    mesh: Mesh, label: NDArray[np.int32], *records: InstanceRecord, volumes: bool = True
) -> tuple[NDArray[np.int32], dict[int, InstanceRecord]]:
    table = InstanceTable(label, (label > 0).astype(np.float32))
    made, found, figures = propose(
        table,
        InstanceRecords(classes=CLASSES, instances=records),
        mesh,
        Detections({}, {}, {1: "hold", 2: "volume"}),
        (),
        PhotoSet(Path()),
        True,
        ProposeSettings(volumes=volumes),
        Silent(),
    )
    assert figures["instances"] == len(found.instances)
    return made.face_instance, {row.id: row for row in found.instances}


def nothing(mesh: Mesh) -> NDArray[np.int32]:
    return np.zeros(len(mesh.faces), dtype=np.int32)


def test_a_pyramid_without_masks_is_a_volume() -> None:
    mesh = sheet(wall(), CELL)
    label, rows = proposed(mesh, nothing(mesh))
    assert (rows[1].kind, rows[1].label, rows[1].evidence) == ("volume", 2, EVIDENCE)
    assert rows[1].faces == np.count_nonzero(label)
    assert (label[near(mesh, 0.24)] == 1).all()
    assert not label[~near(mesh, 0.32)].any()
    assert not proposed(mesh, nothing(mesh), volumes=False)[1]


@pytest.mark.parametrize(("height", "half"), [(0.03, 0.3), (0.1, 0.08)])
def test_a_flat_or_small_bump_is_no_volume(height: float, half: float) -> None:
    mesh = sheet(wall(height, half), CELL)
    assert not proposed(mesh, nothing(mesh))[1]


def test_a_fin_is_no_volume() -> None:
    """It runs from the floor to the top, so that wall is at two of its sides alone."""
    heights = wall(0.0)
    heights[:, 55:65] += 0.2
    mesh = sheet(heights, CELL)
    assert not proposed(mesh, nothing(mesh))[1]


def test_a_volume_with_masks_stays_and_so_does_a_hold_on_a_volume() -> None:
    mesh = sheet(wall(), CELL)
    label = nothing(mesh)
    label[near(mesh, 0.2)] = 4
    record = InstanceRecord(4, 2, "volume", 0.6, {"2": 1.0}, (), int((label == 4).sum()))
    after, rows = proposed(mesh, label, record)
    assert rows == {4: record}
    assert np.array_equal(after, label)
    label[:] = 0
    label[near(mesh, 0.05)] = 4
    hold = InstanceRecord(4, 1, "hold", 0.6, {"1": 1.0}, (), int((label == 4).sum()))
    after, rows = proposed(mesh, label, hold)
    assert rows[4] == hold
    assert np.array_equal(after == 4, label == 4)
    assert rows[5].kind == "volume"
    assert (after[near(mesh, 0.24) & (label == 0)] == 5).all()


def test_a_volume_of_few_masks_gets_the_outline_of_its_solid() -> None:
    mesh = sheet(wall(), CELL)
    label = nothing(mesh)
    label[near(mesh, 0.15) & (mesh.centroids[:, 0] < AT[0])] = 4
    views = (("a.jpg", 0),)
    record = InstanceRecord(4, 2, "volume", 0.08, {"2": 1.0}, views, int((label == 4).sum()))
    after, rows = proposed(mesh, label, record)
    assert set(rows) == {4}
    assert (rows[4].evidence, rows[4].views, rows[4].score) == (EVIDENCE, views, 0.08)
    assert (after[near(mesh, 0.24)] == 4).all()


def test_what_stands_out_far_from_every_hold_is_no_volume() -> None:
    """A corner of the room, or a box on its wall."""
    mesh = sheet(wall(), CELL)
    for place, count in ((2.1, 2), (2.37, 1)):
        label = nothing(mesh)
        label[np.abs(mesh.centroids[:, [0, 2]] - [place, 1.97]).max(axis=1) < 0.03] = 1
        hold = InstanceRecord(1, 1, "hold", 0.6, {"1": 1.0}, (), int((label == 1).sum()))
        assert len(proposed(mesh, label, hold)[1]) == count
