"""A hold that was missed grows from a tap, with its colour from the photos."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image
from small_wall import SCAN, after, members  # type: ignore[import-not-found]

from walltopo.core import Camera, Mesh, View
from walltopo.editing.replay import replay
from walltopo.editing.snapshot import ScanSnapshot
from walltopo.editing.view_crops import cutout_of, view_crops
from walltopo.scans.edits import Add, Edit, Paint, Ref, Remove, SetHold
from walltopo.scans.holds import Hold, Holds, MeasuredWith, PaletteColour
from walltopo.scans.photos import PhotoSet
from walltopo.scans.pictures import SceneLight

BUMP, PLACE, RADIUS = (2.5, 1.9), (2.5, 0.0, 1.9), 0.12
TOP = 0.05  # metres that the bump stands out


def bumpy() -> Mesh:
    """The small wall with one more bump, which nobody labelled."""
    mesh = SCAN.mesh
    vertices = mesh.vertices.copy()
    square = ((vertices[:, [0, 2]] - BUMP) ** 2).sum(axis=1) / RADIUS**2
    vertices[:, 1] -= TOP * np.sqrt(np.clip(1 - square, 0, None))
    return Mesh(vertices, mesh.faces)


def true_faces(mesh: Mesh) -> NDArray[np.bool_]:
    return np.asarray(np.linalg.norm(mesh.centroids[:, [0, 2]] - BUMP, axis=1) < RADIUS)


@pytest.fixture(scope="module")
def photographed(tmp_path_factory: pytest.TempPathFactory) -> ScanSnapshot:
    """Two photos from before the wall, in which the bump is red."""
    folder = tmp_path_factory.mktemp("photos")
    camera = Camera("SIMPLE_PINHOLE", 640, 480, (480.0, 320.0, 240.0))
    turn = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])  # x right, y down, z forward
    views = []
    for number, x in enumerate((2.3, 2.8)):
        centre = np.array([x, -2.0, 1.8])
        view = View(f"{number}.png", camera, np.column_stack([turn, -turn @ centre]))
        picture = np.full((480, 640, 3), (205, 198, 186), np.uint8)
        column, row = view.project(np.array(PLACE))
        rows, columns = np.mgrid[:480, :640]
        inside = np.hypot(columns + 0.5 - column, rows + 0.5 - row) < RADIUS * 480 / 2.0
        picture[inside] = (200, 30, 40)
        Image.fromarray(picture).save(folder / view.name)
        views.append(view)
    none = np.zeros((0, 3))
    return replace(
        SCAN,
        mesh=bumpy(),
        views=tuple(views),
        photos=PhotoSet(Path(folder)),
        light=SceneLight(np.zeros((2, 3)), none, none, 0.5, 1.0),
        found=_with_palette(),
    )


def _with_palette() -> Holds:
    palette = (PaletteColour("red", (200, 30, 40)), PaletteColour("blue", (40, 80, 190)))
    return msgspec.structs.replace(SCAN.found, palette=palette)


def overlap(snapshot: ScanSnapshot, labels: NDArray[np.int32], number: int) -> float:
    true, found = true_faces(snapshot.mesh), labels == number
    areas = snapshot.mesh.areas
    return float(areas[true & found].sum() / areas[true | found].sum())


@pytest.mark.parametrize("aside", [0.0, 0.06])
def test_a_hold_grows_to_its_edge(photographed: ScanSnapshot, aside: float) -> None:
    at = (PLACE[0] + aside, -0.04, PLACE[2])
    found = replay(photographed, [Add(hold=Ref(52, at))])
    assert found.notes == ()
    assert overlap(photographed, found.labels, 52) > 0.7
    hold = {row.id: row for row in found.holds.holds}[52]
    assert hold.colour == "red"
    assert hold.photos
    assert hold.size == pytest.approx(2 * RADIUS, rel=0.25)
    assert hold.position[1] < 0
    # Nothing of other holds was taken, and the log gives the same again.
    others = photographed.labels > 0
    np.testing.assert_array_equal(found.labels[others], photographed.labels[others])
    again = replay(photographed, [Add(hold=Ref(52, at))])
    np.testing.assert_array_equal(again.labels, found.labels)


def test_relief_alone_does_without_photos(photographed: ScanSnapshot) -> None:
    blind = replace(photographed, views=())
    found = replay(blind, [Add(hold=Ref(52, (PLACE[0], -0.05, PLACE[2])))])
    assert overlap(blind, found.labels, 52) > 0.6
    hold = {row.id: row for row in found.holds.holds}[52]
    assert (hold.colour, hold.photos) == ("unknown", ())
    assert 52 in found.routes.unrouted


def test_what_was_added_is_a_hold_like_others(photographed: ScanSnapshot) -> None:
    at = (PLACE[0], -0.05, PLACE[2])
    found = replay(photographed, [Add(hold=Ref(52, at)), Remove(hold=Ref(52, at))])
    assert [row.id for row in found.holds.left_out][-1] == 52
    assert members(found) == members(after([]))


def test_no_surface_there_is_reported() -> None:
    found = after([Add(hold=Ref(52, (50.0, 0.0, 1.0)))])
    assert "no free surface" in found.notes[0].text
    np.testing.assert_array_equal(found.labels, SCAN.labels)


def test_what_was_painted_or_cut_off_is_read_again(photographed: ScanSnapshot) -> None:
    """Painted over the red bump a hold is red, unless a setter named its colour."""
    hold = next(h for h in photographed.found.holds if h.role == "hold" and h.colour != "red")
    at, here = (PLACE[0], -0.03, PLACE[2]), Ref(hold.id, hold.position)
    painted = Paint(hold=here, at=at, radius_m=RADIUS)
    away = Paint(hold=Ref(0), at=hold.position, radius_m=0.2)

    def after_all(*edits: Edit) -> Hold:
        rows = replay(photographed, edits).holds.holds
        return next(row for row in rows if row.id == hold.id)

    assert after_all(painted, away).colour == "red"
    assert after_all(painted, away).photos == ("0.png", "1.png")
    shown = SetHold(hold=here, colour="blue")
    assert after_all(shown, painted, away).colour == "blue"
    little = Paint(hold=here, at=hold.position, radius_m=0.02)
    assert after_all(little).colour == hold.colour


def test_an_added_hold_has_a_picture(photographed: ScanSnapshot) -> None:
    found = replay(photographed, [Add(hold=Ref(52, (PLACE[0], -0.05, PLACE[2])))])
    view = found.pictures[52]
    assert view is not None
    assert np.median(view.crop[view.mask], axis=0).tolist() == [200, 30, 40]
    assert cutout_of(view).startswith("data:image/webp;base64,")
    assert cutout_of(None) == ""


def test_what_hides_a_place_hides_it(photographed: ScanSnapshot) -> None:
    looks = view_crops(photographed, np.array([*PLACE[:1], -TOP, PLACE[2]]), 0.3, 5)
    assert sorted(look.name for look in looks) == ["0.png", "1.png"]
    for look in looks:
        assert look.picture[int(look.y), int(look.x)].tolist() == [200, 30, 40]
    behind = view_crops(photographed, np.array([PLACE[0], 0.5, PLACE[2]]), 0.3, 5)
    assert behind == []


def test_a_new_hold_is_measured_with_the_settings_of_the_scan(photographed: ScanSnapshot) -> None:
    measured_with = MeasuredWith(cutout_px=20)
    found = msgspec.structs.replace(photographed.found, measured_with=measured_with)
    outcome = replay(replace(photographed, found=found), [Add(hold=Ref(52, PLACE))])
    picture = outcome.pictures[52]
    assert picture is not None
    assert max(picture.crop.shape) <= 20


def test_a_volume_is_the_solid_that_stands_out_at_a_place() -> None:
    """A pyramid of 0.7 m between the columns of holds, and nothing beside it."""
    vertices = SCAN.mesh.vertices.copy()
    away = np.abs(vertices[:, [0, 2]] - (2.5, 1.9)).max(axis=1)
    vertices[:, 1] -= np.maximum(0.0, 0.25 * (1 - away / 0.35))
    scan = replace(SCAN, mesh=Mesh(vertices, SCAN.mesh.faces))
    at = (2.45, -0.2, 1.85)
    found = replay(scan, [Add(hold=Ref(52, at), kind="volume")])
    assert found.notes == ()
    places = np.abs(scan.mesh.centroids[:, [0, 2]] - (2.5, 1.9)).max(axis=1)
    assert (found.labels[places < 0.3] == 52).all()
    assert not (found.labels[places > 0.4] == 52).any()
    volume = {row.id: row for row in found.holds.holds}[52]
    assert (volume.kind, volume.role, volume.type) == ("volume", "volume", "volume")
    assert 52 not in found.routes.unrouted
    beside = replay(scan, [Add(hold=Ref(52, (1.5, 0.0, 3.5)), kind="volume")])
    assert "size stands out" in beside.notes[0].text
    np.testing.assert_array_equal(beside.labels, scan.labels)
