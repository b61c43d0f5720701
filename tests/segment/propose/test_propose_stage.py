"""The stage on a made-up wall of two panels: a hold that no mask tells of, and one of few masks."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from tests.geometry.test_panels import folded, sheet

from walltopo.core import Camera, Mesh, View
from walltopo.describe.settings import ClassifySettings
from walltopo.geometry.zbuffer import render_ids
from walltopo.pipeline.stages.propose import Reads, run
from walltopo.scans.artifacts import Context
from walltopo.scans.colmap_model import SparseModel
from walltopo.scans.detections import Detections
from walltopo.scans.instances import InstanceRecord, InstanceRecords, InstanceTable
from walltopo.scans.photos import PhotoSet
from walltopo.scans.scale import Scale
from walltopo.segment.settings import ProposeSettings

METRES = Scale(method="measure", scale=1.0, metric=True, up_known=True, floor_known=True)
RED, GREY = (170, 40, 40), (170, 170, 166)
SIZE = (320, 240)


def near(mesh: Mesh, x: float, z: float, radius: float) -> NDArray[np.bool_]:
    return np.asarray(np.hypot(mesh.centroids[:, 0] - x, mesh.centroids[:, 2] - z) < radius)


def wall() -> Mesh:
    """The folded wall with a hold at (0.6, 1.0), and two more beside it."""
    height = folded(0.0005)
    z, x = np.mgrid[:101, :121] * 0.02
    for place in ((0.6, 0.5), (0.6, 1.5)):
        height[np.hypot(x - place[0], z - place[1]) < 0.07] += 0.05
    return sheet(height)


def front(name: str, x: float) -> View:
    """A view from 2.2 m before the wall, straight at it."""
    rotation = np.array([[1.0, 0, 0], [0, 0, -1.0], [0, 1.0, 0]])
    camera = Camera("SIMPLE_RADIAL", *SIZE, (210.0, 160.0, 120.0, 0.0))
    return View(name, camera, np.column_stack([rotation, -rotation @ [x, -2.2, 1.0]]))


def reads(folder: Path, hold: tuple[int, int, int]) -> Reads:
    """A scan whose middle hold has that colour and no mask; the two others have masks."""
    mesh = wall()
    label = np.zeros(len(mesh.faces), dtype=np.int32)
    label[near(mesh, 0.6, 0.5, 0.075)], label[near(mesh, 0.6, 1.5, 0.075)] = 1, 2
    paint = np.array([GREY, RED, RED, hold], dtype=np.float64)
    own = np.where(near(mesh, 0.6, 1.0, 0.075), 3, label)
    views = [front(f"{k}.jpg", 0.4 + 0.2 * k) for k in range(4)]
    for view in views:
        face, _ = render_ids(mesh.vertices, mesh.faces, view.camera, view.cam_from_world)
        shade = 0.7 + 0.3 * np.abs(mesh.normals[face, 1])
        picture = paint[own[face]] * shade[..., None] * (face >= 0)[..., None]
        Image.fromarray(picture.astype(np.uint8)).save(folder / view.name, quality=95)
    sparse = SparseModel(folder)
    sparse.__dict__["views"] = tuple(views)  # what COLMAP's files would say
    records = InstanceRecords(
        classes={"1": "hold", "2": "volume"},
        instances=tuple(
            InstanceRecord(k, 1, "hold", 0.7, {"1": 1.0}, (), int((label == k).sum()))
            for k in (1, 2)
        ),
    )
    return Reads(
        photos=PhotoSet(folder),
        sparse=sparse,
        scale=METRES,
        mesh=mesh,
        detections=Detections({}, {}, {1: "hold", 2: "volume"}),
        lifted=InstanceTable(label, (label > 0).astype(np.float32)),
        lifted_records=records,
    )


def test_a_hold_without_masks_is_found_by_relief_and_colour(tmp_path: Path) -> None:
    given = reads(tmp_path, RED)
    made = run(given, ProposeSettings(relief=True), Context(tmp_path, tmp_path))
    rows = {row.id: row for row in made.instance_records.instances}
    assert sorted(rows) == [1, 2, 3]
    assert rows[3].kind == "hold"
    assert rows[3].views == ()
    assert rows[3].evidence is not None
    assert rows[3].confidence > ClassifySettings().min_evidence
    label = made.instances.face_instance
    assert (label[near(given.mesh, 0.6, 1.0, 0.05)] == 3).all()
    assert not label[~near(given.mesh, 0.6, 1.0, 0.11) & (given.lifted.face_instance == 0)].any()
    for number in (1, 2):
        assert rows[number].confidence > ClassifySettings().min_evidence
        held = given.lifted.face_instance == number
        assert (label[held] == number).all()


def test_a_bump_of_the_walls_own_colour_is_doubtful(tmp_path: Path) -> None:
    made = run(reads(tmp_path, GREY), ProposeSettings(relief=True), Context(tmp_path, tmp_path))
    (row,) = [row for row in made.instance_records.instances if row.id == 3]
    assert ProposeSettings().listed <= row.confidence < ClassifySettings().min_evidence


def test_switched_off_nothing_changes(tmp_path: Path) -> None:
    given = reads(tmp_path, RED)
    made = run(given, ProposeSettings(), Context(tmp_path, tmp_path))
    made.instance_records.save(tmp_path / "a.json")
    given.lifted_records.save(tmp_path / "b.json")
    assert (tmp_path / "a.json").read_bytes() == (tmp_path / "b.json").read_bytes()
    assert b"evidence" not in (tmp_path / "a.json").read_bytes()
    assert np.array_equal(made.instances.face_instance, given.lifted.face_instance)
    assert np.array_equal(made.instances.face_score, given.lifted.face_score)
