"""Poses of other programs: files written by hand from each format's documentation.

All files of `samples` describe two cameras of 640 x 480 pixels. One stands in front of a wall and
looks straight at it, the other looks along it, from its right end; both are upright. Their
numbers follow from the axes that the documentation names, and owe nothing to our own code.
"""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from walltopo.core import InputError, View
from walltopo.reconstruct.poses.formats import read_poses

SAMPLES = Path(__file__).with_name("samples")
Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Stand:
    """A camera's place, the direction in which it looks, and the direction to its photo's top."""

    centre: Vector
    direction: Vector
    top: Vector


Y_UP = (
    Stand((1, 1.6, 3), (0, 0, -1), (0, 1, 0)),
    Stand((3, 1.6, 0.5), (-1, 0, 0), (0, 1, 0)),
)
Z_UP = (
    Stand((1, 2, 1.6), (0, 1, 0), (0, 0, 1)),
    Stand((3, 0.5, 1.6), (1, 0, 0), (0, 0, 1)),
)
NAMES = ("101", "102")
LENS = (0.01, 0.0, 0.001, 0.002)  # k1, k2, p1, p2 in OpenCV's order


@dataclass(frozen=True)
class Sample:
    """The content of a sample: stands, focal lengths, principal point and lens."""

    stands: tuple[Stand, Stand]
    focal: tuple[float, float] = (500.0, 501.0)
    middle: tuple[float, float] = (322.0, 239.0)
    lens: tuple[float, ...] = LENS
    names: tuple[str, str] = NAMES


EXPECTED = {
    "polycam": Sample(Y_UP, lens=()),
    "record3d": Sample(Y_UP, middle=(320.0, 240.0), lens=(), names=("0", "1")),
    "nerfstudio": Sample(Y_UP),
    "colmap": Sample(Y_UP),
    "realityscan-xmp": Sample(Z_UP, focal=(500.0, 500.0)),
    "realityscan-csv": Sample(Z_UP, focal=(500.0, 500.0)),
    "metashape": Sample(Z_UP),
}


def test_each_sample_is_expected() -> None:
    assert {folder.name for folder in SAMPLES.iterdir()} == set(EXPECTED)


def with_photos(sample: str, names: Sequence[str], folder: Path) -> tuple[Path, list[Path]]:
    """Return a copy of a sample, and empty photos of these names in it."""
    export = shutil.copytree(SAMPLES / sample, folder / "export")
    photos = [export / f"{name}.jpg" for name in names]
    for photo in photos:
        Image.new("RGB", (640, 480)).save(photo)
    return export, photos


@pytest.mark.parametrize("name", EXPECTED)
def test_cameras_stand_where_the_file_says(name: str, tmp_path: Path) -> None:
    expected = EXPECTED[name]
    export, photos = with_photos(name, (*expected.names, "999"), tmp_path)
    found = read_poses(export, photos)
    assert [Path(photo.source).stem for photo in found.photos] == list(expected.names)
    for posed, stand in zip(found.photos, expected.stands, strict=True):
        assert_stands(posed.view, stand)
        matrix = posed.view.camera.matrix()
        np.testing.assert_allclose(matrix[[0, 1], [0, 1]], expected.focal)
        np.testing.assert_allclose(matrix[:2, 2], expected.middle)
        lens = posed.view.camera.params[4 : 4 + len(expected.lens)]
        assert lens == pytest.approx(expected.lens)


def assert_stands(view: View, stand: Stand) -> None:
    np.testing.assert_allclose(view.centre, stand.centre, atol=1e-9)
    np.testing.assert_allclose(view.direction, stand.direction, atol=1e-9)
    down = view.cam_from_world[1, :3]
    np.testing.assert_allclose(-down, stand.top, atol=1e-9)


@pytest.mark.parametrize(
    ("sample", "file", "old", "new", "message"),
    [
        (
            "realityscan-xmp",
            "102.xmp",
            "brown3t2",
            "division",
            "102.xmp: the lens model 'division'",
        ),
        ("realityscan-xmp", "102.xmp", "0.01 0 0 0", "0.01 0 0 0.2", "102.xmp: .* k4"),
        ("realityscan-csv", "cameras.csv", "0,0,0.002", "0,0.2,0.002", "cameras.csv: .* k4"),
    ],
)
def test_a_lens_that_is_not_understood_is_an_error(
    sample: str, file: str, old: str, new: str, message: str, tmp_path: Path
) -> None:
    export, photos = with_photos(sample, NAMES, tmp_path)
    path = export / file
    path.write_text(path.read_text("utf-8").replace(old, new), "utf-8")
    with pytest.raises(InputError, match=message) as failure:
        read_poses(export, photos)
    assert "Brown3" in failure.value.hint


def test_a_division_without_distortion_is_a_pinhole(tmp_path: Path) -> None:
    export, photos = with_photos("realityscan-xmp", NAMES, tmp_path)
    for path in export.glob("*.xmp"):
        text = path.read_text("utf-8").replace("brown3t2", "division")
        path.write_text(text.replace("0.01 0 0 0 0.002 0.001", "0 0 0 0 0 0"), "utf-8")
    found = read_poses(export, photos)
    assert all(photo.view.camera.is_pinhole for photo in found.photos)


def test_poses_of_a_smaller_component_are_in_another_frame(tmp_path: Path) -> None:
    export, photos = with_photos("metashape", (*NAMES, "103"), tmp_path)
    file = export / "cameras.xml"
    unaligned = '<camera id="2" sensor_id="0" label="103"/>'
    alone = (
        '<camera id="2" sensor_id="0" component_id="1" label="103">'
        "<transform>1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1</transform></camera>"
    )
    text = file.read_text("utf-8")
    assert unaligned in text
    file.write_text(text.replace(unaligned, alone), "utf-8")
    found = read_poses(export, photos)
    assert [photo.source for photo in found.photos] == ["101.jpg", "102.jpg"]


@pytest.mark.parametrize(("coordinates", "expected"), [("relative", 2), ("absolute", 3)])
def test_relative_xmp_poses_are_of_one_component(
    coordinates: str, expected: int, tmp_path: Path
) -> None:
    export, photos = with_photos("realityscan-xmp", ("100", *NAMES), tmp_path)
    shutil.copy(export / "101.xmp", export / "100.xmp")
    for photo, component in zip(photos, ("{A}", "{B}", "{B}"), strict=True):
        file = photo.with_suffix(".xmp")
        text = file.read_text("utf-8").replace(
            'xcr:Coordinates="absolute"',
            f'xcr:Coordinates="{coordinates}" xcr:ComponentId="{component}"',
        )
        file.write_text(text, "utf-8")
    found = read_poses(export, photos)
    assert [photo.source for photo in found.photos] == ["100.jpg", "101.jpg", "102.jpg"][-expected:]


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16"])
@pytest.mark.parametrize("name", EXPECTED)
def test_text_that_windows_wrote_is_read(name: str, encoding: str, tmp_path: Path) -> None:
    expected = EXPECTED[name]
    export, photos = with_photos(name, expected.names, tmp_path)
    plain = read_poses(export, photos)
    for file in export.rglob("*"):
        if file.is_file() and file.suffix != ".jpg":
            file.write_text(file.read_text("utf-8"), encoding)
    assert read_poses(export, photos) == plain
