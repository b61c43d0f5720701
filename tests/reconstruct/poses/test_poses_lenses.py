"""Scans from right poses, through the lens of each camera model, by each reader that has lenses."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from distorted_photos import LENSES, distort_photos, lens_params  # type: ignore[import-not-found]
from written_poses import SIZE, WRITERS, view_at, write_colmap  # type: ignore[import-not-found]

from walltopo.core import Camera, InputError, View
from walltopo.core.view import CAMERA_MODELS
from walltopo.pipeline.runner import scan
from walltopo.pipeline.settings import load_settings
from walltopo.reconstruct.poses.formats import read_poses
from walltopo.scans.colmap_lens import camera_of
from walltopo.scans.colmap_model import read_views
from walltopo.scans.folder import ScanFolder

TRUTH = Path(__file__).parents[2] / "data" / "tiny-gym-truth.npz"
PRISMS = ("THIN_PRISM_FISHEYE", "RAD_TAN_THIN_PRISM_FISHEYE")
BROWN = ("PINHOLE", "OPENCV", "FULL_OPENCV")
LENSED = ("nerfstudio", "colmap", "realityscan-xmp", "realityscan-csv", "metashape")


def gym_views() -> list[View]:
    """Return the exact views of the tiny gym."""
    truth = np.load(TRUTH)
    focal, _, cx, cy = truth["intrinsics"].tolist()
    width, height = truth["size"].tolist()
    camera = Camera("SIMPLE_RADIAL", width, height, (focal, cx, cy, *truth["distortion"].tolist()))
    return [
        View(f"IMG_{k:04d}.jpg", camera, pose) for k, pose in enumerate(truth["cam_from_world"])
    ]


def with_camera(views: Sequence[View], camera: Camera) -> list[View]:
    return [View(view.name, camera, view.cam_from_world) for view in views]


def brown_lens(model: str, camera: Camera) -> Camera:
    """Return a lens of Brown's polynomial, as the formats of other programs have it."""
    params = lens_params(model, camera)
    if model == "FULL_OPENCV":
        params[9:] = (0.0, 0.0, 0.0)
    return Camera(model, camera.width, camera.height, tuple(params))


def assert_places(photos: Path, poses: Path, views: Sequence[View], out: Path) -> None:
    """Scan photos with poses; the cameras must stay where they are."""
    settings = load_settings(None, [f"sparse.poses={poses}", "sparse.threads=1"])
    scan(photos, out, settings, to_stage="sparse")
    found = {view.name: view for view in read_views(ScanFolder(out).sparse_raw)}
    assert found.keys() == {view.name for view in views}
    away = [np.linalg.norm(found[view.name].centre - view.centre) for view in views]
    assert max(away) < 0.006


@pytest.mark.slow
@pytest.mark.parametrize("model", [name for name in LENSES if name not in PRISMS])
def test_right_poses_fit_through_each_lens_of_colmap(
    model: str, tiny_photos: Path, tmp_path: Path
) -> None:
    views = gym_views()
    distort_photos(tiny_photos, views[0].camera, model, tmp_path / "photos")
    write_colmap(tmp_path / "poses", views)
    cameras = tmp_path / "poses" / "sparse" / "0" / "cameras.txt"
    camera = views[0].camera
    params = " ".join(map(repr, lens_params(model, camera)))
    lines = [
        f"{number} {model} {camera.width} {camera.height} {params}\n"
        for number in range(1, len(views) + 1)
    ]
    cameras.write_text("".join(lines), "utf-8")
    assert_places(tmp_path / "photos", tmp_path / "poses", views, tmp_path / "scan")


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in LENSED if name != "colmap"])
@pytest.mark.parametrize("model", ["OPENCV", "FULL_OPENCV"])
def test_right_poses_fit_by_each_reader(
    name: str, model: str, tiny_photos: Path, tmp_path: Path
) -> None:
    views = gym_views()
    lens = brown_lens(model, views[0].camera)
    distort_photos(tiny_photos, views[0].camera, model, tmp_path / "photos", lens.params)
    (tmp_path / "poses").mkdir()
    WRITERS[name](tmp_path / "poses", with_camera(views, lens))
    assert_places(tmp_path / "photos", tmp_path / "poses", views, tmp_path / "scan")


@pytest.mark.slow
def test_a_fisheye_of_nerfstudio_fits(tiny_photos: Path, tmp_path: Path) -> None:
    views, model = gym_views(), "OPENCV_FISHEYE"
    camera = views[0].camera
    lens = Camera(model, camera.width, camera.height, tuple(lens_params(model, camera)))
    distort_photos(tiny_photos, camera, model, tmp_path / "photos")
    (tmp_path / "poses").mkdir()
    WRITERS["nerfstudio"](tmp_path / "poses", with_camera(views, lens))
    assert_places(tmp_path / "photos", tmp_path / "poses", views, tmp_path / "scan")


@pytest.mark.parametrize("name", LENSED)
@pytest.mark.parametrize("model", BROWN)
def test_each_reader_keeps_the_lens(name: str, model: str, tmp_path: Path) -> None:
    from PIL import Image

    width, height = SIZE
    lens = brown_lens(model, Camera("PINHOLE", width, height, (500.0, 500.0, 322.0, 239.0)))
    views = [
        View(f"{k}.jpg", lens, view_at("", (10, k, 5), (k, 0, 2), 500.0).cam_from_world)
        for k in range(2)
    ]
    (tmp_path / "poses").mkdir()
    photos = [tmp_path / view.name for view in views]
    for photo in photos:
        Image.new("RGB", SIZE).save(photo)
    WRITERS[name](tmp_path / "poses", views)
    point = np.array([0.4, -0.3, 1.0])
    for posed in read_poses(tmp_path / "poses", photos).photos:
        np.testing.assert_allclose(posed.view.camera.project(point), lens.project(point), atol=1e-6)


@pytest.mark.parametrize("model", LENSES)
def test_a_lens_of_colmap_is_expressed_or_refused(model: str) -> None:
    from walltopo.geometry.colmap import pycolmap

    base = Camera("PINHOLE", 480, 360, (355.0, 355.0, 240.0, 180.0))
    lens = pycolmap.Camera(model=model, width=480, height=360, params=lens_params(model, base))
    if model in PRISMS:
        with pytest.raises(InputError, match=model) as failure:
            camera_of(lens)
        assert "ndistort" in failure.value.hint
        return
    found = camera_of(lens)
    assert found.model in CAMERA_MODELS
    rays = np.array([(0.0, 0.0, 1.0), (0.3, 0.2, 1.0), (-0.6, 0.4, 1.0), (0.5, -0.45, 1.0)])
    np.testing.assert_allclose(found.project(rays), lens.img_from_cam(rays), atol=0.1)


def test_a_fisheye_without_coefficients_is_not_a_pinhole() -> None:
    fisheye = Camera("OPENCV_FISHEYE", 200, 200, (100.0, 100.0, 100.0, 100.0, 0.0, 0.0, 0.0, 0.0))
    assert not fisheye.is_pinhole
    at = fisheye.project(np.array([1.0, 0.0, 1.0]))
    np.testing.assert_allclose(at, [100 + 100 * np.pi / 4, 100])


@pytest.mark.parametrize("tag", ["k4", "p3", "p4", "b2", "skew"])
def test_a_lens_parameter_of_metashape_is_not_ignored(tag: str, tmp_path: Path) -> None:
    export, photos = export_of("metashape", tmp_path)
    file = export / "cameras.xml"
    text = file.read_text("utf-8")
    file.write_text(text.replace("<cx>", f"<{tag}>0.01</{tag}><cx>"), "utf-8")
    with pytest.raises(InputError, match=rf"cameras\.xml: .*{tag} is not understood"):
        read_poses(export, photos)
    file.write_text(text.replace("<cx>", f"<{tag}>0</{tag}><cx>"), "utf-8")
    assert len(read_poses(export, photos).photos) == 2


@pytest.mark.parametrize(("name", "value"), [("Skew", "0.1"), ("AspectRatio", "1.01")])
def test_a_skewed_camera_of_realityscan_is_not_ignored(
    name: str, value: str, tmp_path: Path
) -> None:
    export, photos = export_of("realityscan-xmp", tmp_path)
    for file in export.glob("*.xmp"):
        old = f'{name}="{0 if name == "Skew" else 1}"'
        text = file.read_text("utf-8")
        assert old in text
        file.write_text(text.replace(old, f'{name}="{value}"'), "utf-8")
    with pytest.raises(InputError, match=f"{name} is not"):
        read_poses(export, photos)


def export_of(name: str, folder: Path) -> tuple[Path, list[Path]]:
    """Write an export of two photos; return its folder and the photos."""
    from PIL import Image

    views = [view_at(f"{k}.jpg", (10, 20 * k, 5), (k, 0.5, 2), 500.0) for k in range(2)]
    export = folder / "export"
    export.mkdir()
    WRITERS[name](export, views)
    photos = [export / view.name for view in views]
    for photo in photos:
        Image.new("RGB", SIZE).save(photo)
    return export, photos


@pytest.mark.parametrize("model", ["OPENCV", "OPENCV_FISHEYE"])
def test_a_lens_that_folds_within_the_photo_is_refused(model: str, tmp_path: Path) -> None:
    """Such as parameters in pixels, or of another model."""
    export, photos = export_of("nerfstudio", tmp_path)
    file = export / "transforms.json"
    text = file.read_text("utf-8").replace('"camera_model": "OPENCV"', f'"camera_model": "{model}"')
    file.write_text(text.replace('"k1": 0.0', '"k1": -8.0'), "utf-8")
    with pytest.raises(InputError, match=r"transforms\.json: 0\.jpg: the lens .* folds back"):
        read_poses(export, photos)


@pytest.mark.slow
def test_poses_of_other_photos_are_refused_before_all_are_matched(tmp_path: Path) -> None:
    photos = sorted((Path(__file__).parents[3] / "examples" / "demo-photos").glob("*.jpg"))
    from PIL import Image

    with Image.open(photos[0]) as picture:
        width, height = picture.size
    lens = Camera("PINHOLE", width, height, (width, width, width / 2, height / 2))
    rng = np.random.default_rng(0)
    views = [
        View(photo.name, lens, view_at("", rng.normal(0, 20, 3), rng.random(3), 1).cam_from_world)
        for photo in photos
    ]
    write_colmap(tmp_path / "poses", views)
    settings = load_settings(None, [f"sparse.poses={tmp_path / 'poses'}"])
    out = ScanFolder(tmp_path / "scan")
    with pytest.raises(InputError, match="do not fit the photos"):
        scan(photos[0].parent, out.root, settings, to_stage="sparse")
    assert not (out.work / "features").exists()
