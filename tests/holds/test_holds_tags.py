"""Start tags in photos: of a card on a wall, and of what is no card."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
from colmap_text import write_model  # type: ignore[import-not-found]
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from PIL import Image

from walltopo.core import Camera, Mesh, Silent, View
from walltopo.holds import stage as classify
from walltopo.holds.contract import ClassifySettings
from walltopo.holds.observations import Picture
from walltopo.holds.tag_fit import GRID, fit_card
from walltopo.holds.tag_looks import CardSizes
from walltopo.holds.tags import FoundTag, TagFinder, band_looks, record_of
from walltopo.meshes.ply import write_ply
from walltopo.raycast import render_ids
from walltopo.routes import stage as cluster
from walltopo.routes.contract import RoutesSettings
from walltopo.scans.folder import ScanFolder
from walltopo.core.files import read_json, write_json
from walltopo.scans.attributes import read_tags

TEXEL = 0.0025  # metres of the wall's painting
WALL = (0.74, 0.62, 0.45)
Pixels = NDArray[np.uint8]


def painting(seed: int = 0) -> NDArray[np.float32]:
    """A plywood wall of 2 x 2 m, row 0 at the top, with grain and T-nuts."""
    rng = np.random.default_rng(seed)
    image = np.full((800, 800, 3), WALL, np.float32)
    image *= 1 + 0.03 * cv2.GaussianBlur(rng.standard_normal((800, 800, 1)), (0, 0), 1.5)[..., None]
    for x in range(40, 800, 80):
        for y in range(40, 800, 80):
            cv2.circle(image, (x, y), 4, (0.1, 0.1, 0.1), -1)
    return image


def put_card(
    image: NDArray[np.float32], x: float, z: float, band: tuple[float, ...] | None = (0.1, 0.2, 0.8)
) -> None:
    """A card of 75 x 45 mm at (x, z) metres, with two lines of print and a band at its left."""
    column, row = x / TEXEL, 800 - z / TEXEL

    def box(x0: float, x1: float, y0: float, y1: float, colour: tuple[float, ...]) -> None:
        a = (round(column + 15 * x0), round(row + 9 * y0))
        b = (round(column + 15 * x1) - 1, round(row + 9 * y1) - 1)
        cv2.rectangle(image, a, b, colour, -1)

    box(-1, 1, -1, 1, (0.9, 0.9, 0.88))
    if band is not None:
        box(-1, -0.5, -1, 1, band)
    box(-0.3, 0.7, -0.55, -0.2, (0.2, 0.2, 0.2))
    box(-0.3, 0.5, 0.2, 0.55, (0.2, 0.2, 0.2))


def wall_mesh(bump: tuple[float, float] | None = None) -> tuple[Mesh, NDArray[np.int32]]:
    """The wall, in the plane y = 0 with its outside towards -y; a dome of 5 cm is instance 1."""
    x, z = np.meshgrid(np.linspace(0, 2, 101), np.linspace(0, 2, 101))
    y = np.zeros_like(x)
    if bump is not None:
        away = np.hypot(x - bump[0], z - bump[1])
        y = -0.05 * np.sqrt(np.clip(1 - (away / 0.06) ** 2, 0, None))
    vertices = np.column_stack([x.ravel(), y.ravel(), z.ravel()])
    a = (np.arange(100)[:, None] * 101 + np.arange(100)).ravel()
    faces = np.vstack(
        [np.column_stack([a, a + 1, a + 102]), np.column_stack([a, a + 102, a + 101])]
    ).astype(np.int32)
    mesh = Mesh(vertices, faces)
    labels = np.zeros(len(faces), np.int32)
    if bump is not None:
        labels[np.hypot(mesh.centroids[:, 0] - bump[0], mesh.centroids[:, 2] - bump[1]) < 0.06] = 1
    return mesh, labels


EYES = ((0.4, -1.9, 1.0), (1.0, -1.7, 0.6), (1.7, -1.8, 1.4), (1.9, -1.5, 0.9), (0.1, -1.4, 1.3))


def view_from(number: int, scale: float = 1.0) -> View:
    centre = np.array(EYES[number]) * scale
    forward = np.array([1.0, 0.0, 1.0]) * scale - centre
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, [0, 0, 1.0])
    right /= np.linalg.norm(right)
    rotation = np.stack([right, np.cross(forward, right), forward])
    camera = Camera("SIMPLE_RADIAL", 960, 720, (700.0, 480.0, 360.0, 0.0))
    return View(f"{number}.jpg", camera, np.column_stack([rotation, -rotation @ centre]))


def photo_of(image: NDArray[np.float32], view: View, scale: float, seed: int) -> Pixels:
    """The painted wall as a camera sees it, blurred and with noise."""
    corners = np.array([(0, 0, 2), (2, 0, 2), (2, 0, 0), (0, 0, 0)], dtype=float) * scale
    source = np.array([(0, 0), (800, 0), (800, 800), (0, 800)], dtype=np.float32) - 0.5
    target = (view.project(corners) - 0.5).astype(np.float32)
    to_photo = cv2.getPerspectiveTransform(source, target)
    sharp = cv2.warpPerspective(image, to_photo, (960, 720), flags=cv2.INTER_AREA)
    noisy = cv2.GaussianBlur(sharp, (0, 0), 0.8)
    noisy = noisy + np.random.default_rng(seed).normal(0, 0.01, noisy.shape)
    return np.asarray(np.clip(noisy * 235, 0, 255), np.uint8)


def found_on(
    image: NDArray[np.float32],
    bump: tuple[float, float] | None = None,
    scale: float = 1.0,
    least: float = 0.4,
    hide: bool = False,
) -> list[FoundTag]:
    """The tags that five photos of a painted wall show; `hide`: the bump is no instance."""
    mesh, labels = wall_mesh(bump)
    mesh = Mesh(mesh.vertices * scale, mesh.faces)
    finder = TagFinder(mesh, CardSizes.of(ClassifySettings(), scale), small={4})
    for number in range(len(EYES)):
        view = view_from(number, scale)
        face, depth = render_ids(mesh.vertices, mesh.faces, view.camera, view.cam_from_world)
        ids = np.where(face >= 0, labels[np.maximum(face, 0)], 0).astype(np.int32)
        pixels = photo_of(image, view, scale, number)
        finder.read(Picture(number, view, pixels, face, depth, 0 * ids if hide else ids))
    return finder.tags(least)


@pytest.mark.parametrize("scale", [1.0, 7.3])
def test_cards_are_found_where_they_are(scale: float) -> None:
    image = painting()
    places = [(0.63, 0.83), (1.38, 1.02)]
    for x, z in places:
        put_card(image, x, z)
    found = found_on(image, scale=scale)
    assert len(found) == 2
    for tag in found:
        away = [
            np.hypot(tag.position[0] / scale - x, tag.position[2] / scale - z) for x, z in places
        ]
        assert min(away) < 0.006
        assert tag.width / scale == pytest.approx(0.075, abs=0.015)
        assert tag.height / scale == pytest.approx(0.045, abs=0.012)
        assert abs(tag.normal @ (0, -1, 0)) > 0.99
        assert tag.confidence > 0.6
        assert tag.instance == 0
        bands = np.array([look.linear for look in band_looks(tag)])
        assert len(bands) >= 3
        assert (bands[:, 2] > 3 * bands[:, 0]).all()  # blue


def test_what_is_no_card_is_not_found() -> None:
    image = painting(1)
    cv2.rectangle(image, (150, 300), (179, 317), (0.9, 0.9, 0.88), -1)  # paper without print
    cv2.circle(image, (400, 420), 13, (0.9, 0.9, 0.9), -1)  # a white foothold with its bolt
    cv2.circle(image, (400, 420), 3, (0.2, 0.2, 0.2), -1)
    cv2.rectangle(image, (560, 300), (690, 420), (0.9, 0.9, 0.88), -1)  # a poster
    for row in range(315, 415, 16):
        cv2.line(image, (575, row), (670, row), (0.2, 0.2, 0.2), 4)
    letters = np.zeros((800, 800), np.uint8)
    cv2.putText(letters, "GYM", (180, 650), cv2.FONT_HERSHEY_SIMPLEX, 4, 255, 16)
    image[letters > 127] = 0.9
    cv2.ellipse(image, (600, 600), (20, 9), 30, 0, 360, (0.92, 0.92, 0.92), -1)  # chalk
    assert found_on(image) == []


def test_print_on_a_bump_is_no_card_unless_the_bump_is_flat() -> None:
    """What stands out of the wall is a hold, labelled or not."""
    for hide in (False, True):
        image = painting(2)
        put_card(image, 1.0, 1.0)
        assert found_on(image, bump=(1.0, 1.0), hide=hide) == []


def test_a_card_taken_for_a_hold_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    image = painting(3)
    put_card(image, 1.0, 1.0)
    mesh, labels = wall_mesh()
    across = np.abs(mesh.centroids[:, [0, 2]] - 1.0)
    labels[(across[:, 0] < 0.05) & (across[:, 1] < 0.035)] = 4
    monkeypatch.setattr(__name__ + ".wall_mesh", lambda bump: (mesh, labels))
    found = found_on(image)
    assert [tag.instance for tag in found] == [4]
    labels[labels == 4] = 5  # too large an instance for a card: print on a volume
    assert found_on(image) == []


def test_one_photo_is_not_enough() -> None:
    image = painting(4)
    put_card(image, 1.0, 1.0)
    mesh, _ = wall_mesh()
    finder = TagFinder(mesh, CardSizes.of(ClassifySettings(), 1.0))
    view = view_from(0)
    face, depth = render_ids(mesh.vertices, mesh.faces, view.camera, view.cam_from_world)
    ids = np.zeros_like(face)
    finder.read(Picture(0, view, photo_of(image, view, 1.0, 0), face, depth, ids))
    assert finder.likely
    assert finder.tags(0.1) == []


def test_a_card_without_a_band_has_no_colour() -> None:
    image = painting(5)
    put_card(image, 1.0, 1.0, band=None)
    (tag,) = found_on(image)
    assert band_looks(tag) == []
    record = record_of(3, tag, "", [f"{k}.jpg" for k in range(5)])
    assert (record.id, record.colour) == (3, "")
    assert record.photos[0].endswith(".jpg")


BUMPS = {1: (0.6, 0.6), 2: (0.75, 1.0), 3: (0.6, 1.4), 4: (1.2, 0.6), 5: (1.35, 1.0), 6: (1.2, 1.4)}


@pytest.fixture
def scan(tmp_path: Path) -> ScanFolder:
    """Two blue routes of three bumps with a card under each lowest; one card is instance 7."""
    mesh, labels = wall_mesh()
    vertices = mesh.vertices.copy()
    image = painting(6)
    for number, (x, z) in BUMPS.items():
        away = np.hypot(vertices[:, 0] - x, vertices[:, 2] - z)
        vertices[:, 1] -= 0.05 * np.sqrt(np.clip(1 - (away / 0.07) ** 2, 0, None))
        middle = mesh.centroids[:, [0, 2]] - (x, z)
        labels[np.linalg.norm(middle, axis=1) < 0.07] = number
        cv2.circle(image, (round(x / TEXEL), round(800 - z / TEXEL)), 28, (0.1, 0.2, 0.75), -1)
    put_card(image, 0.6, 0.45)
    put_card(image, 1.2, 0.45)
    across = np.abs(mesh.centroids[:, [0, 2]] - (1.2, 0.45))
    labels[(across[:, 0] < 0.05) & (across[:, 1] < 0.035)] = 7
    mesh = Mesh(vertices, mesh.faces)
    folder = ScanFolder(tmp_path / "scan")
    write_ply(folder.mesh, mesh)
    np.savez(folder.instances, face_instance=labels, face_score=(labels > 0).astype(np.float32))
    rows = [{"id": k, "class": "hold", "label": 1, "score": 1.0} for k in range(1, 8)]
    write_json(folder.instance_records, {"version": 1, "instances": rows})
    folder.photos.mkdir()
    views = [view_from(number) for number in range(len(EYES))]
    for number, view in enumerate(views):
        pixels = photo_of(image, view, 1.0, number)
        Image.fromarray(pixels).save(folder.photos / view.name, quality=95)
    write_model(folder.sparse, views)
    return folder


def test_from_photos_to_routes(scan: ScanFolder) -> None:
    """Tags are found and named by the palette, none is a hold, and routes start at them."""
    metrics = classify.run(scan, ClassifySettings(), Silent())
    assert (metrics["tags"], metrics["holds"]) == (2, 6)
    tags = read_tags(scan.attributes)
    assert [tag.colour for tag in tags] == ["blue", "blue"]
    for tag, x in zip(sorted(tags, key=lambda tag: tag.position), (0.6, 1.2), strict=True):
        assert tag.position == pytest.approx((x, 0.0, 0.45), abs=0.008)
        assert len(tag.photos) >= 4
    (row,) = read_json(scan.attributes)["left_out"]
    assert (row["id"], row["reason"]) == (7, "is a start tag")
    cluster.run(scan, RoutesSettings(max_hold_dist=0.5, min_hold_dist=0.4), Silent())
    routes = read_json(scan.routes)["routes"]
    assert [route["start"] for route in routes] == [[1], [4]]
    assert sorted(tag for route in routes for tag in route["tags"]) == [1, 2]


def test_without_the_setting_nothing_is_looked_for(scan: ScanFolder) -> None:
    metrics = classify.run(scan, ClassifySettings(start_tags=False), Silent())
    assert metrics["tags"] == 0


@settings(max_examples=60, deadline=None, derandomize=True)
@given(
    width=st.integers(26, 40),
    height=st.integers(18, 26),
    contrast=st.integers(20, 110),
    banded=st.booleans(),
    seed=st.integers(0, 1000),
)
def test_the_sides_of_a_card_are_found(
    width: int, height: int, contrast: int, banded: bool, seed: int
) -> None:
    """Starting from print and band alone, as on a light wall; the grain is a third as strong."""
    rng = np.random.default_rng(seed)
    patch = np.full((GRID, GRID, 3), 120.0)
    x0, y0 = (GRID - width) // 2, (GRID - height) // 2
    card = patch[y0 : y0 + height, x0 : x0 + width]
    card += contrast
    ink = slice(width // 4 + 2, width // 4 + 2 + int(0.4 * width))
    card[4:7, ink] = card[-7:-4, ink] = 60
    if banded:
        card[:, : width // 4] = (20, 40, 160)
    patch = cv2.GaussianBlur(patch, (0, 0), 0.7) + rng.normal(0, contrast / 20, patch.shape)
    start = x0 if banded else x0 + width // 4 + 2
    box = (start, x0 + width - 7, y0 + (0 if banded else 4), y0 + height - (0 if banded else 4))
    fit = fit_card(np.clip(patch, 0, 255).astype(np.uint8), box)
    assert fit is not None
    true = (x0, x0 + width, y0, y0 + height)
    assert np.abs(np.array(fit.box) - true).max() <= 4
    assert (fit.linear is not None) == banded
