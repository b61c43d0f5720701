"""`walltopo lift` on well-formed input that means something else, or that has lost a part."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from walltopo.cli import main
from walltopo.core import Camera, InputError, Mask, View
from walltopo.geometry.mesh_files import write_ply
from walltopo.segment.lift_files import find_cameras, read_cameras, read_masks
from walltopo.segment.lift_matching import attach_masks

CAMERA = Camera("PINHOLE", 128, 96, (100.0, 100.0, 64.0, 48.0))
MASK = Mask.from_full(np.ones((96, 128), dtype=np.bool_), 1)


def views(*names: str) -> list[View]:
    return [View(name, CAMERA, np.eye(4)[:3]) for name in names]


def matched(cameras: list[str], photos: list[str], **options: bool) -> dict[str, bool]:
    """Return whether each camera got masks."""
    found = attach_masks(views(*cameras), dict.fromkeys(photos, (MASK,)), **options)
    return {view.name: bool(view.masks) for view in found.views}


@pytest.mark.parametrize(
    ("camera", "photo"),
    [
        ("0001.jpg", "0001.png"),
        ("0001.jpg", "0001.jpg.png"),
        ("0001.jpg", "0001.PNG"),
        ("0001.JPG", "images/0001.jpg"),
        ("cam0/0001.jpg", "0001.jpg"),
        ("cam0/0001.jpg", "cam0\\0001.jpg"),
        ("a.b.jpg", "a.b.png"),
        ("Gr\u00fcn.jpg", "Gru\u0308n.jpg"),
    ],
)
def test_names_that_mean_the_same_match(camera: str, photo: str) -> None:
    assert matched([camera], [photo]) == {camera: True}


def test_folders_decide_between_equal_names() -> None:
    cameras = ["cam0/0001.jpg", "cam1/0001.jpg"]
    assert matched(cameras, ["cam0/0001.jpg"]) == {cameras[0]: True, cameras[1]: False}
    assert matched(cameras, ["labels/cam1/0001.png"]) == {cameras[0]: False, cameras[1]: True}


@pytest.mark.parametrize(
    ("cameras", "photos"),
    [
        (["cam0/0001.jpg", "cam1/0001.jpg"], ["0001.jpg"]),
        (["0001.jpg"], ["cam0/0001.jpg", "cam1/0001.jpg"]),
    ],
)
def test_names_that_match_twice_are_refused(cameras: list[str], photos: list[str]) -> None:
    with pytest.raises(InputError, match=r"cam0/0001.jpg, cam1/0001.jpg"):
        matched(cameras, photos)


def test_a_photo_of_another_folder_does_not_take_the_camera_of_its_namesake() -> None:
    found = attach_masks(
        views("cam0/0001.jpg"), {"cam0/0001.jpg": (MASK,), "cam1/0001.jpg": (MASK,)}
    )
    assert found.without_camera == ("cam1/0001.jpg",)
    assert found.describe_loss() == "1 of 2 photos of the masks have no camera: cam1/0001.jpg"


def test_losing_more_than_half_is_refused_unless_allowed() -> None:
    photos = ["a.jpg", "x1.jpg", "x2.jpg"]
    with pytest.raises(InputError, match=r"2 of 3 photos .*: x1.jpg, x2.jpg"):
        matched(["a.jpg", "b.jpg"], photos)
    assert matched(["a.jpg", "b.jpg"], photos, allow_missing=True) == {
        "a.jpg": True,
        "b.jpg": False,
    }


def test_masks_of_turned_photos_are_refused_with_the_reason() -> None:
    turned = Mask.from_full(np.ones((128, 96), dtype=np.bool_), 1)
    with pytest.raises(InputError, match="96x128 pixels, its camera 128x96") as caught:
        attach_masks(views("a.jpg"), {"a.jpg": (turned,)})
    assert "EXIF" in caught.value.hint
    wide = Mask.from_full(np.ones((72, 128), dtype=np.bool_), 1)
    with pytest.raises(InputError, match="128x72") as caught:
        attach_masks(views("a.jpg"), {"a.jpg": (wide,)})
    assert "EXIF" not in caught.value.hint


@pytest.mark.parametrize("size", [(48, 64), (33, 43), (960, 1280), (97, 129)])
def test_masks_of_another_resolution_are_accepted(size: tuple[int, int]) -> None:
    other = Mask.from_full(np.ones(size, dtype=np.bool_), 1)
    assert attach_masks(views("a.jpg"), {"a.jpg": (other,)}).views[0].masks


def write_transforms(path: Path, common: dict[str, Any], *names: str) -> Path:
    frames = [{"file_path": name, "transform_matrix": np.eye(4).tolist()} for name in names]
    path.write_text(json.dumps({"w": 128, "h": 96, "fl_x": 100.0, "frames": frames} | common))
    return path


def test_frames_of_several_cameras_keep_their_folders(tmp_path: Path) -> None:
    path = write_transforms(
        tmp_path / "transforms.json", {}, "./images/cam0/0001.jpg", "./images/cam1/0001.jpg"
    )
    assert [view.name for view in read_cameras(path)] == ["cam0/0001.jpg", "cam1/0001.jpg"]


@pytest.mark.parametrize(
    ("common", "model", "distortion"),
    [
        ({}, "OPENCV", (0, 0, 0, 0)),
        ({"k3": 0.02}, "FULL_OPENCV", (0, 0, 0, 0, 0.02, 0, 0, 0)),
        ({"is_fisheye": True, "k1": 0.1}, "OPENCV_FISHEYE", (0.1, 0, 0, 0)),
        ({"camera_model": "OPENCV_FISHEYE", "k4": 0.1}, "OPENCV_FISHEYE", (0, 0, 0, 0.1)),
        ({"camera_model": "PINHOLE", "k6": 0, "aabb_scale": 16}, "OPENCV", (0, 0, 0, 0)),
    ],
)
def test_lenses_are_read(
    tmp_path: Path, common: dict[str, Any], model: str, distortion: tuple[float, ...]
) -> None:
    (view,) = read_cameras(write_transforms(tmp_path / "transforms.json", common, "a.jpg"))
    assert (view.camera.model, view.camera.distortion) == (model, distortion)


@pytest.mark.parametrize(
    ("common", "named"),
    [
        ({"camera_model": "EQUIRECTANGULAR"}, "EQUIRECTANGULAR"),
        ({"k5": 0.1}, "k5"),
        ({"k4": 0.1}, "k4"),
        ({"skew": 0.1}, "skew"),
        ({"w": None}, "no size"),
    ],
)
def test_a_lens_that_is_not_understood_is_refused(
    tmp_path: Path, common: dict[str, Any], named: str
) -> None:
    path = write_transforms(tmp_path / "transforms.json", common, "a.jpg")
    with pytest.raises(InputError, match=named):
        read_cameras(path)


def test_a_size_that_is_missing_comes_from_the_masks(tmp_path: Path) -> None:
    path = write_transforms(tmp_path / "transforms.json", {"w": None, "h": None}, "images/a.jpg")
    (view,) = read_cameras(path, {"a.png": (640, 480)})
    assert (view.camera.width, view.camera.height) == (640, 480)


def test_a_palette_holds_numbers_too(tmp_path: Path) -> None:
    from PIL import Image

    numbers = np.zeros((96, 128), dtype=np.uint8)
    numbers[:10], numbers[20:30] = 1, 2
    picture = Image.fromarray(numbers).convert("P")
    picture.putdata(numbers.ravel().tolist())
    picture.putpalette([0, 0, 0, 128, 0, 0, 0, 128, 0])
    (tmp_path / "cam0").mkdir()
    picture.save(tmp_path / "cam0" / "0001.PNG", "PNG")
    found = read_masks(tmp_path)
    assert list(found.masks) == ["cam0/0001.PNG"]
    assert [mask.area for mask in found.masks["cam0/0001.PNG"]] == [1280, 1280]


def test_a_project_has_its_largest_model(tmp_path: Path) -> None:
    for number, size in enumerate((10, 1000, 100)):
        (tmp_path / "sparse" / str(number)).mkdir(parents=True)
        (tmp_path / "sparse" / str(number) / "images.bin").write_bytes(bytes(size))
    assert find_cameras(tmp_path) == (tmp_path / "sparse" / "1", 3)
    assert find_cameras(tmp_path / "sparse" / "2") == (tmp_path / "sparse" / "2", 1)
    assert find_cameras(tmp_path / "nothing") == (tmp_path / "nothing", 1)


def test_a_text_model_with_a_space_in_a_name_says_so(tmp_path: Path) -> None:
    (tmp_path / "cameras.txt").write_text("1 PINHOLE 128 96 100 100 64 48\n")
    (tmp_path / "points3D.txt").write_text("")
    (tmp_path / "images.txt").write_text("# images\n1 1 0 0 0 0 0 0 1 my wall.jpg\n\n")
    with pytest.raises(InputError, match=r"'my wall\.jpg' contains a space"):
        read_cameras(tmp_path)


def lift(files: Path, *more: str) -> int:
    given = ["--mesh", "mesh.ply", "--cameras", "transforms.json", "--masks", "ids", "-o", "out"]
    return main(["lift", *(w if w.startswith("-") else str(files / w) for w in given), *more])


def test_losses_are_printed(files: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for number in (0, 1):
        (files / "ids" / f"{number}.png").rename(files / "ids" / f"other{number}.png")
    assert lift(files) == 0
    output = " ".join(capsys.readouterr().out.split())
    assert "2 of 8 photos of the masks have no camera: other0.png, other1.png" in output
    assert "3 instances" in output


def test_more_lost_than_kept_is_an_error(files: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for number in range(5):
        (files / "ids" / f"{number}.png").rename(files / "ids" / f"other{number}.png")
    assert lift(files) != 0
    assert "5 of 8 photos" in " ".join(capsys.readouterr().err.split())
    assert not (files / "out").exists()
    assert lift(files, "--allow-missing") == 0


@pytest.mark.parametrize(("scale", "reason"), [(1000.0, "a ratio of"), (20.0, "--normalised")])
def test_nothing_found_is_an_error_with_its_reason(
    files: Path, three_bumps: Any, scale: float, reason: str, capsys: pytest.CaptureFixture[str]
) -> None:
    from walltopo.core import Mesh

    mesh, _, _ = three_bumps
    if scale == 1000.0:  # a mesh in millimetres, cameras in metres: rays pass beside its triangles
        write_ply(files / "mesh.ply", Mesh(mesh.vertices * scale + [5000, 0, 0], mesh.faces))
    else:
        data = json.loads((files / "transforms.json").read_text())
        for frame in data["frames"]:
            for row in frame["transform_matrix"][:3]:
                row[3] *= scale
        (files / "transforms.json").write_text(json.dumps(data))
        write_ply(files / "mesh.ply", Mesh(mesh.vertices * scale, mesh.faces))
    assert lift(files) != 0
    error = " ".join(capsys.readouterr().err.split())
    assert "0 instances" in error
    assert reason in error


def test_empty_masks_are_an_error(files: Path, capsys: pytest.CaptureFixture[str]) -> None:
    shutil.rmtree(files / "ids")
    images = [{"id": n, "file_name": f"{n}.jpg", "width": 96, "height": 72} for n in range(8)]
    rows = [{"id": n, "image_id": n, "category_id": 1, "segmentation": []} for n in range(8)]
    coco = {"images": images, "annotations": rows, "categories": [{"id": 1, "name": "hold"}]}
    (files / "ids").write_text(json.dumps(coco))
    assert lift(files) != 0
    assert "all 8 masks are empty" in " ".join(capsys.readouterr().err.split())
