"""Nothing of a hidden place is left in any file that people see."""

from __future__ import annotations

import base64
import re
from collections.abc import Callable
from io import BytesIO

import numpy as np
import pytest
from glbfile import Glb  # type: ignore[import-not-found]
from hypothesis import given
from hypothesis import strategies as st
from made_scan import export_scan, panel  # type: ignore[import-not-found]
from numpy.typing import NDArray
from PIL import Image

from walltopo.core import Camera, Silent, View
from walltopo.images.files import read_rgb
from walltopo.publish.files.labelme import write_labelme
from walltopo.publish.hidden_texture import hide_in_texture
from walltopo.publish.settings import ExportSettings
from walltopo.publish.wall_data import read_wall
from walltopo.scans.folder import ScanFolder
from walltopo.scans.hidden import HiddenPlace, HiddenPlaces, are_hidden, hidden_pixels

MakeScan = Callable[..., ScanFolder]
PERSON = (255, 0, 255)
PLACE = HiddenPlace((3.0, 0.0, 2.0), 0.5)
SMALL = ExportSettings(
    first_triangles=1000, detail_triangles=2500, first_texture=256, detail_texture=256
)


def _with_person(scan: ScanFolder) -> ScanFolder:
    """Draw a disc of 0.4 m over the middle of the wall, in texture and photos."""
    for path in (scan.texture, *scan.photos.glob("*.jpg")):
        picture = np.array(Image.open(path).convert("RGB"))
        height, width = picture.shape[:2]
        if path == scan.texture:
            x, y, radius = width / 2, height / 2, 0.4 / 6 * width
        else:  # 6 m away, 240 pixels of focal length; each camera is 1 m farther right
            x = 160 + 240 * (3.0 - (1 + int(path.stem[-1]))) / 6
            y, radius = 120 - 240 * 0.3 / 6, 0.4 * 240 / 6
        rows, columns = np.mgrid[:height, :width]
        picture[(columns + 0.5 - x) ** 2 + (rows + 0.5 - y) ** 2 < radius**2] = PERSON
        Image.fromarray(picture).save(path, quality=95)
    return scan


def _shows_person(picture: NDArray[np.uint8]) -> bool:
    red, green, blue = picture.astype(int).transpose(2, 0, 1)
    return bool(((red > green + 60) & (blue > green + 60)).any())


def _pictures(glb: bytes) -> list[NDArray[np.uint8]]:
    parsed = Glb(glb)
    found = []
    for image in parsed.json["images"]:
        view = parsed.json["bufferViews"][image["bufferView"]]
        start = view.get("byteOffset", 0)
        data = parsed.binary[start : start + view["byteLength"]]
        found.append(np.array(Image.open(BytesIO(bytes(data))).convert("RGB")))
    return found


@pytest.mark.parametrize("hide", [False, True])
def test_no_exported_file_shows_a_hidden_person(make_scan: MakeScan, hide: bool) -> None:
    scan = _with_person(make_scan(cells=60))
    if hide:
        HiddenPlaces(places=(PLACE,)).save(scan.hidden)
    export_scan(scan, SMALL)
    files = [scan.glb, *scan.page_assets.glob("*.glb")]
    assert len(files) >= 3
    for file in files:
        for picture in _pictures(file.read_bytes()):
            assert _shows_person(picture) is not hide, file.name
    report = scan.report.read_text()
    embedded = re.findall(r"data:image/webp;base64,([A-Za-z0-9+/=]+)", report)
    shown = [
        np.array(Image.open(BytesIO(base64.b64decode(one))).convert("RGB")) for one in embedded
    ]
    assert any(map(_shows_person, shown)) is not hide
    out = scan.root / "labelled"
    write_labelme(out, scan, read_wall(scan), Silent())
    photos = [read_rgb(path) for path in sorted(out.glob("*.jpg"))]
    assert len(photos) == 3
    assert [_shows_person(photo) for photo in photos] == [not hide] * 3


def test_a_hidden_place_changes_nothing_elsewhere(make_scan: MakeScan) -> None:
    scan = _with_person(make_scan())
    before = read_wall(scan).read_texture()
    HiddenPlaces(places=(PLACE,)).save(scan.hidden)
    after = read_wall(scan).read_texture()
    assert before is not None
    assert after is not None
    height, width = before.shape[:2]
    rows, columns = np.mgrid[:height, :width]
    away = np.hypot((columns + 0.5) / width * 6 - 3, (rows + 0.5) / height * 4 - 2)
    changed = (before != after).any(axis=2)
    assert changed[away < 0.35].all()
    assert not changed[away > 0.55].any()
    # The fill is of the colours around: the wall's beige and one hold.
    assert np.abs(after[away < 0.3].astype(int) - (205, 198, 186)).max() < 120


def test_the_page_is_made_anew_when_a_place_is_hidden_or_shown_again(make_scan: MakeScan) -> None:
    scan = make_scan(cells=60)
    export_scan(scan, SMALL)
    plain = (scan.page_assets / "first.glb").read_bytes()
    HiddenPlaces(places=(PLACE,)).save(scan.hidden)
    export_scan(scan, SMALL)
    assert (scan.page_assets / "first.glb").read_bytes() != plain
    scan.hidden.unlink()
    export_scan(scan, SMALL)
    assert (scan.page_assets / "first.glb").read_bytes() == plain


@given(
    at=st.tuples(st.floats(-0.3, 6.3), st.floats(-0.2, 0.2), st.floats(-0.3, 4.3)),
    radius=st.floats(0.02, 1.5),
    cells=st.sampled_from([2, 5, 40]),
)
def test_each_texel_in_a_hidden_place_is_replaced(
    at: tuple[float, float, float], radius: float, cells: int
) -> None:
    mesh, _, uv, _ = panel(1, cells)
    flat = mesh.vertices.copy()
    flat[:, 1] = 0.0
    mesh = type(mesh)(flat, mesh.faces)
    picture = np.full((80, 120, 3), PERSON, np.uint8)
    rows, columns = np.mgrid[:80, :120]
    points = np.stack(
        [(columns + 0.5) / 20, np.zeros(rows.shape), 4 - (rows + 0.5) / 20], axis=-1
    ).reshape(-1, 3)
    place = HiddenPlace(at, radius)
    inside = are_hidden(points, [place]).reshape(80, 120)
    picture[~inside] = (10, 200, 10)
    hidden = hide_in_texture(picture, mesh, uv, [place])
    assert not (hidden[inside] == PERSON).all(axis=1).any() or inside.mean() > 0.9
    np.testing.assert_array_equal(hidden[~inside], picture[~inside])


@given(
    at=st.tuples(st.floats(-3, 3), st.floats(-1, 8), st.floats(-2, 2)), radius=st.floats(0.02, 2)
)
def test_pixels_of_a_hidden_ball_are_all_found(
    at: tuple[float, float, float], radius: float
) -> None:
    turn = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
    camera = Camera("SIMPLE_RADIAL", 160, 120, (120.0, 80.0, 60.0, 0.05))
    view = View("a.jpg", camera, np.column_stack([turn, np.zeros(3)]))
    points = np.random.default_rng(0).normal(size=(4000, 3))
    points *= radius / np.linalg.norm(points, axis=1, keepdims=True)
    pixels = view.project(points + at)
    pixels = pixels[np.isfinite(pixels).all(axis=1)]
    inside = ((pixels >= 0) & (pixels < (160, 120))).all(axis=1)
    x, y = pixels[inside].astype(int).T
    mask = hidden_pixels(view, [HiddenPlace(at, radius)])
    if at[1] > radius + 0.05:  # wholly in front of the camera
        assert mask[y, x].all()
