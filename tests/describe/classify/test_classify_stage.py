"""The classify stage on a small wall that is drawn by the z-buffer with known paint."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from colmap_text import write_model  # type: ignore[import-not-found]
from msgspec.structs import replace as with_
from PIL import Image

from walltopo.core import Camera, EnvironmentLacksError, InputError, Mesh, View
from walltopo.describe.classify import attributes
from walltopo.describe.classify.geometry import measure_shapes
from walltopo.describe.classify.observations import HoldView
from walltopo.describe.classify.palette import REFERENCE, Entry
from walltopo.describe.settings import ClassifySettings
from walltopo.geometry.mesh_files import write_ply
from walltopo.geometry.zbuffer import render_ids
from walltopo.pipeline.runner import run_stage
from walltopo.pipeline.stages.classify import CLASSIFY
from walltopo.scans.folder import ScanFolder
from walltopo.scans.holds import Hold, Holds, MeasuredWith
from walltopo.scans.instances import InstanceRecord, InstanceRecords, InstanceTable
from walltopo.scans.manifest import Metrics
from walltopo.scans.pictures import Cutouts
from walltopo.scans.scale import Plate, Scale

COLOURS = {1: "red", 2: "blue", 3: "yellow", 4: "red", 5: "wood", 6: "green"}
PLACES = {1: (0.6, 0.6), 2: (1.2, 0.7), 3: (0.7, 1.4), 4: (1.5, 1.5), 5: (1.1, 1.1), 6: (0.2, 2.9)}
STEEP_DEG = 20.0
METRES = Scale(method="measure", scale=1.0, metric=True, up_known=True, floor_known=True)


def classify(scan: ScanFolder, settings: ClassifySettings | None = None) -> Metrics:
    return run_stage(scan, "classify", settings or ClassifySettings())


def read_holds(scan: ScanFolder) -> tuple[Hold, ...]:
    return Holds.load(scan.holds_raw).holds


def bumpy_wall() -> tuple[Mesh, np.ndarray]:
    """A wall that leans over by `STEEP_DEG`, with domes as holds; labels of the faces."""
    n = 81
    u, v = np.meshgrid(np.linspace(0, 2, n), np.linspace(0, 3.2, n))
    out = np.zeros_like(u)
    for x, z in PLACES.values():
        out += 0.06 * np.sqrt(np.clip(1 - ((u - x) ** 2 + (v - z) ** 2) / 0.12**2, 0, None))
    lean = np.radians(STEEP_DEG)
    y = -v * np.sin(lean) - out * np.cos(lean)
    z = v * np.cos(lean) - out * np.sin(lean)
    vertices = np.column_stack([u.ravel(), y.ravel(), z.ravel()])
    a = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    faces = np.vstack(
        [np.column_stack([a, a + 1, a + n + 1]), np.column_stack([a, a + n + 1, a + n])]
    )
    middle = np.column_stack([u.ravel(), v.ravel()])[faces].mean(axis=1)
    labels = np.zeros(len(faces), dtype=np.int32)
    for number, place in PLACES.items():
        labels[np.linalg.norm(middle - place, axis=1) < 0.11] = number
    return Mesh(vertices, faces.astype(np.int32)), labels


def look_at(name: str, eye: tuple[float, float, float]) -> View:
    """A view of the lower part of the wall."""
    centre = np.array(eye)
    forward = np.array([1.0, -0.35, 1.0]) - centre
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, [0, 0, 1.0])
    right /= np.linalg.norm(right)
    rotation = np.stack([right, np.cross(forward, right), forward])
    camera = Camera("SIMPLE_RADIAL", 320, 240, (260.0, 160.0, 120.0, 0.02))
    return View(name, camera, np.column_stack([rotation, -rotation @ centre]))


@pytest.fixture
def scan(tmp_path: Path) -> ScanFolder:
    """A scan folder up to `lift`; hold 6 is seen in no photo."""
    folder = ScanFolder(tmp_path / "scan")
    mesh, labels = bumpy_wall()
    classes = {1: "hold", 2: "volume"}
    write_ply(folder.mesh, mesh)
    METRES.save(folder.scale)
    InstanceTable(labels, (labels > 0).astype(np.float32)).save(folder.instances)
    records = tuple(
        InstanceRecord(
            k, label, classes[label], 1.0, {str(label): 1.0}, (), int((labels == k).sum())
        )
        for k, label in ((k, 2 if k == 5 else 1) for k in COLOURS)
    )
    InstanceRecords(classes={"1": "hold", "2": "volume"}, instances=records).save(
        folder.instance_records
    )
    views = [look_at(f"{k}.jpg", (0.4 + 0.4 * k, -2.4, 1.1)) for k in range(4)]
    folder.photos.mkdir()
    palette = np.array([(170, 168, 160), *(REFERENCE[c] for c in COLOURS.values())])
    for number, view in enumerate(views):
        face, _ = render_ids(mesh.vertices, mesh.faces, view.camera, view.cam_from_world)
        picture = palette[np.where(face >= 0, labels[face], 0)] * (face >= 0)[..., None]
        shade = 0.75 + 0.25 * (mesh.normals[face] @ [0.3, -0.9, 0.3])
        exposure = 0.7 + 0.12 * number
        pixels = np.clip(picture * shade[..., None] * exposure, 0, 255).astype(np.uint8)
        Image.fromarray(pixels).save(folder.photos / view.name, quality=95)
    write_model(folder.sparse, views)
    return folder


def test_stage_finds_colour_and_shape(scan: ScanFolder) -> None:
    metrics = classify(scan)
    holds = {hold.id: hold for hold in read_holds(scan)}
    assert metrics["unseen"] == 1
    for number in (1, 2, 3, 4, 5):
        assert holds[number].colour == COLOURS[number], number
        assert holds[number].steepness_deg == pytest.approx(STEEP_DEG, abs=3)
        assert holds[number].size == pytest.approx(0.22, abs=0.04)
        assert len(holds[number].photos) >= 3
    assert holds[5].role == holds[5].type == "volume"
    x, y, z = holds[1].position
    assert (x, z / np.cos(np.radians(STEEP_DEG))) == pytest.approx((0.6, 0.6), abs=0.05)
    assert y < 0


def test_an_instance_without_cutouts_is_unknown_and_for_review(scan: ScanFolder) -> None:
    classify(scan)
    hold = read_holds(scan)[5]
    assert (hold.id, hold.colour, hold.colour_confidence, hold.photos) == (6, "unknown", 0.0, ())
    assert hold.review
    index = Cutouts.load(scan.cutouts).index
    assert 6 not in {entry.id for entry in index}


def test_cutouts_carry_the_mask_and_the_pixel_count(scan: ScanFolder) -> None:
    classify(scan, ClassifySettings(cutouts=2, cutout_px=40))
    index = Cutouts.load(scan.cutouts).index
    assert len(index) == 10
    for entry in index:
        picture = Image.open(scan.cutouts / entry.file)
        assert picture.mode == "RGBA"
        assert max(picture.size) <= 40
        opaque = np.asarray(picture)[..., 3] > 127
        assert 0 < opaque.sum() <= entry.pixels


def test_the_same_twice(scan: ScanFolder) -> None:
    classify(scan)
    first = scan.holds_raw.read_bytes()
    classify(scan)
    assert scan.holds_raw.read_bytes() == first


def test_a_palette_file_names_colours_and_roles(scan: ScanFolder, tmp_path: Path) -> None:
    path = tmp_path / "palette.toml"
    rows = [("scarlet", "red", "hold"), ("sea", "blue", "downclimb"), ("sun", "yellow", "hold")]
    path.write_text(
        "".join(
            f'[[colour]]\nname = "{name}"\nrgb = {list(REFERENCE[term])}\nrole = "{role}"\n'
            for name, term, role in rows
        )
    )
    classify(scan, ClassifySettings(palette=str(path)))
    holds = {hold.id: hold for hold in read_holds(scan)}
    assert [holds[k].colour for k in (1, 2, 3, 4)] == ["scarlet", "sea", "sun", "scarlet"]
    assert holds[2].role == "downclimb"


def test_labels_of_another_mesh_are_refused(scan: ScanFolder) -> None:
    InstanceTable(np.zeros(3, np.int32), np.zeros(3, np.float32)).save(scan.instances)
    with pytest.raises(InputError, match="labels 3 triangles"):
        classify(scan)


def test_a_missing_photo_is_named(scan: ScanFolder) -> None:
    (scan.photos / "2.jpg").unlink()
    with pytest.raises(InputError, match=r"2\.jpg"):
        classify(scan)


def test_shape_does_not_depend_on_where_the_wall_stands() -> None:
    mesh, labels = bumpy_wall()
    turn = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    moved = replace(mesh, vertices=mesh.vertices @ turn.T + [3.0, -7.0, 0.0])
    here, there = (measure_shapes(m, labels, [1, 9]) for m in (mesh, moved))
    assert sorted(here) == [1]  # 9 has no triangles
    np.testing.assert_allclose(there[1].position, here[1].position @ turn.T + [3, -7, 0])
    np.testing.assert_allclose(there[1].normal, here[1].normal @ turn.T, atol=1e-9)
    assert there[1].size == pytest.approx(here[1].size)
    assert there[1].protrusion_m == pytest.approx(0.06, abs=0.02)


def test_a_doubtful_instance_is_listed_and_not_a_hold(
    scan: ScanFolder,
) -> None:
    table = InstanceRecords.load(scan.instance_records)
    records = [with_(r, score=0.1) if r.id == 4 else r for r in table.instances]
    with_(table, instances=tuple(records)).save(scan.instance_records)
    metrics = classify(scan)
    found = Holds.load(scan.holds_raw)
    assert [hold.id for hold in found.holds] == [1, 2, 3, 5, 6]
    (row,) = found.left_out
    assert (row.id, row.score) == (4, 0.1)
    assert row.photos
    assert row.colour != "unknown", "all is known of it, for who keeps it"
    assert metrics["left_out"] == 1
    assert sum(entry.id == 4 for entry in Cutouts.load(scan.cutouts).index) == 1

    classify(scan, ClassifySettings(min_score=0.1))
    assert Holds.load(scan.holds_raw).left_out == ()


class NamedSea:
    """A plug-in that knows hold 2 and its colour."""

    def __init__(self, settings: ClassifySettings) -> None:
        assert settings.model == "sea.onnx"

    def holds(self, holds: Sequence[Hold], seen: Mapping[int, Sequence[HoldView]]) -> list[Hold]:
        assert 6 not in seen, "no photo shows it"
        return [
            with_(hold, type="jug", colour="sea", role="downclimb") if hold.id == 2 else hold
            for hold in holds
        ]

    def palette(self, entries: Sequence[Entry], holds: Sequence[Hold]) -> list[Entry]:
        return [*entries, Entry("sea", (0, 90, 120))]


def test_a_plug_in_names_types_colours_and_roles(
    scan: ScanFolder, monkeypatch: pytest.MonkeyPatch
) -> None:
    point = SimpleNamespace(load=lambda: NamedSea)
    monkeypatch.setattr(attributes, "entry_points", lambda group: [point])
    classify(scan, ClassifySettings(model="sea.onnx"))
    found = Holds.load(scan.holds_raw)
    hold = next(hold for hold in found.holds if hold.id == 2)
    assert (hold.type, hold.colour, hold.role) == ("jug", "sea", "downclimb")
    assert "sea" in {entry.name for entry in found.palette}


def test_a_model_without_a_plug_in_is_an_error(
    scan: ScanFolder, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(attributes, "entry_points", lambda group: [])
    with pytest.raises(EnvironmentLacksError, match="none is installed"):
        CLASSIFY.check(ClassifySettings(model="sea.onnx"))


def test_what_lies_on_a_printed_plate_is_no_hold(scan: ScanFolder) -> None:
    classify(scan)
    place = np.array(read_holds(scan)[1].position)
    sheet = np.array([[-0.2, 0, 0.15], [0.2, 0, 0.15], [0.2, 0, -0.15], [-0.2, 0, -0.15]])
    near, far = (
        tuple((x, y, z) for x, y, z in rows.tolist())
        for rows in (place + sheet, place + sheet + [0, 1.0, 0])
    )
    plate = Plate((0,), "sheet", True, "markers", 1.0, 0.1, 0.1, (), "")
    unplaced = with_(plate, ids=(1,))
    plates: tuple[Plate, ...]
    for plates, left_out in (
        ((with_(plate, corners=far), unplaced), []),
        ((with_(plate, corners=near),), [2]),
    ):
        with_(METRES, plates=plates).save(scan.scale)
        classify(scan)
        rows = Holds.load(scan.holds_raw).left_out
        assert [row.id for row in rows] == left_out
    assert rows[0].left_out == "lies on a printed plate"


def test_the_unit_of_an_unscaled_scan_is_written_once(scan: ScanFolder) -> None:
    """By this scan's own setting; every later reader takes it from the file."""
    with_(METRES, metric=False).save(scan.scale)
    classify(scan, ClassifySettings(typical_hold=0.3))
    found = Holds.load(scan.holds_raw)
    sizes = [hold.size for hold in found.holds if hold.role == "hold" and hold.size > 0]
    assert found.unit == pytest.approx(np.median(sizes) / 0.3)
    METRES.save(scan.scale)
    classify(scan)
    assert Holds.load(scan.holds_raw).unit == 1.0


def test_edited_holds_are_measured_with_the_settings_of_the_scan(scan: ScanFolder) -> None:
    classify(scan, ClassifySettings(colour_spread=0.2, lightness_weight=0.5, cutout_px=64))
    assert Holds.load(scan.holds_raw).measured_with == MeasuredWith(0.2, 0.5, 64)
