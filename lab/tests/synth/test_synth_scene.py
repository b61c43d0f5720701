"""A tiny gym rendered once: its photos, masks and truth agree with each other."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from walltopo.core import Camera, InputError, SettingsError
from walltopo.core.outputs import Target, claimed_folder
from walltopo.scans.coco_import import read_coco_masks
from walltopo.scans.colmap_model import open_model, read_views
from walltopo_lab.cli import synth as synth_cli
from walltopo_lab.synth import PhotoSettings, generate, tiny_recipe
from walltopo_lab.synth.path import look_at
from walltopo_lab.synth.recipe import _check_folder
from walltopo_lab.synth.shade import distorted_rays
from walltopo_lab.synth.tracer import Tracer


def test_rays_invert_the_lens() -> None:
    camera = Camera("SIMPLE_RADIAL", 40, 30, (33.0, 20.0, 15.0, 0.05))
    pose = look_at(np.array([0.3, -2.0, 1.5]), np.array([0.1, 0.5, 1.0]), 0.2)
    rotation = np.ascontiguousarray(pose[:, :3])
    rays = distorted_rays(0, 30, 40, 1, 33.0, 20.0, 15.0, 0.05, rotation).astype(np.float64)
    pixels = camera.project(rays @ pose[:, :3].T).reshape(30, 40, 2)
    x, y = np.meshgrid(np.arange(40) + 0.5, np.arange(30) + 0.5)
    np.testing.assert_allclose(pixels, np.stack([x, y], axis=-1), atol=1e-4)


def test_files_have_the_shared_format(tiny_gym: Path) -> None:
    truth = np.load(tiny_gym / "truth" / "gt.npz")
    faces = len(truth["faces"])
    assert truth["faces"].dtype == np.int32
    assert truth["vertices"].shape[1] == 3
    for key in ("face_instance", "face_views", "face_class", "face_route"):
        assert truth[key].shape == (faces,)
    assert truth["cam_from_world"].shape == (8, 3, 4)
    assert truth["size"].tolist() == [480, 360]
    scene = json.loads((tiny_gym / "truth" / "scene.json").read_text())
    ids = {item["id"] for item in scene["instances"]}
    assert ids == set(np.unique(truth["face_instance"])) - {0}
    keys = {"id", "class", "kind", "colour", "route", "position", "normal"}
    assert all(keys <= set(item) for item in scene["instances"])
    side = np.diff(np.array(scene["plates"][0]["corners_bl_br_tr_tl"]), axis=0)
    np.testing.assert_allclose(np.linalg.norm(side, axis=1), 0.42, atol=1e-9)


def test_the_photos_of_the_products_tests_are_made_by_it(tiny_gym: Path, tiny_photos: Path) -> None:
    names = sorted(path.name for path in tiny_photos.iterdir())
    assert names == sorted(path.name for path in (tiny_gym / "photos").iterdir())
    for name in names:
        made, kept = (
            np.asarray(Image.open(folder / name), dtype=np.float64)
            for folder in (tiny_gym / "photos", tiny_photos)
        )
        # The kept photos are older than exact coarse levels of bitmaps (0.54).
        assert np.abs(made - kept).mean() < 0.6, name


def test_colmap_model_carries_the_true_poses(tiny_gym: Path) -> None:
    truth = np.load(tiny_gym / "truth" / "gt.npz")
    views = read_views(tiny_gym / "truth" / "cameras")
    assert [view.name for view in views] == [f"IMG_{k:04d}.jpg" for k in range(8)]
    for view, pose in zip(views, truth["cam_from_world"], strict=True):
        np.testing.assert_allclose(view.cam_from_world, pose, atol=1e-9)
        assert view.camera.params[3] == truth["distortion"][0]
    assert open_model(tiny_gym / "truth" / "cameras").num_reg_images() == 8


def test_masks_are_where_the_mesh_projects(tiny_gym: Path) -> None:
    truth = np.load(tiny_gym / "truth" / "gt.npz")
    vertices = truth["vertices"].astype(np.float64)
    tracer = Tracer(vertices, truth["faces"])
    masks, classes = read_coco_masks(tiny_gym / "truth" / "masks.json")
    assert classes == {1: "hold", 2: "volume"}
    annotations = json.loads((tiny_gym / "truth" / "masks.json").read_text())["annotations"]
    numbers = iter(a["instance_id"] for a in annotations)
    for view in read_views(tiny_gym / "truth" / "cameras"):
        assert masks[view.name], "every tiny photo shows holds"
        camera = view.camera
        rotation = np.ascontiguousarray(view.cam_from_world[:, :3])
        rays = distorted_rays(
            0,
            camera.height,
            camera.width,
            1,
            camera.fx,
            camera.cx,
            camera.cy,
            camera.distortion[0],
            rotation,
        )
        origins = np.tile(view.centre.astype(np.float32), (len(rays), 1))
        face = tracer.hits(origins, rays)["primID"]
        seen = np.where(face >= 0, truth["face_instance"][face], 0)
        seen = seen.reshape(camera.height, camera.width)
        for mask in masks[view.name]:
            expected, bitmap = seen == next(numbers), mask.full()
            union = np.count_nonzero(expected | bitmap)
            # the rim of a small mask is a large part of it
            assert np.count_nonzero(expected ^ bitmap) <= 0.15 * union + 10


def test_faces_count_the_photos_that_see_them(tiny_gym: Path) -> None:
    truth = np.load(tiny_gym / "truth" / "gt.npz")
    assert truth["face_views"].max() == 8
    held = truth["face_instance"] > 0
    assert 0.05 < (truth["face_views"][held] > 0).mean() < 0.95, "backs of holds are never seen"


def test_markers_are_found_where_the_plate_lies(tiny_gym: Path) -> None:
    import cv2

    detector = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50))
    scene = json.loads((tiny_gym / "truth" / "scene.json").read_text())
    left_bottom, right_bottom, _, left_top = np.array(scene["plates"][0]["corners_bl_br_tr_tl"])
    right = (right_bottom - left_bottom) / 0.42
    down = (left_bottom - left_top) / 0.42
    errors = []
    for view in read_views(tiny_gym / "truth" / "cameras"):
        photo = np.asarray(Image.open(tiny_gym / "photos" / view.name).convert("L"))
        corners, ids, _ = detector.detectMarkers(photo)
        for number, quad in zip([] if ids is None else ids.ravel().tolist(), corners, strict=True):
            row, column = ((0, 0), (0, 1), (1, 1), (1, 0))[int(number) % 4]
            start = left_top + right * (0.02 + 0.23 * column) + down * (0.02 + 0.23 * row)
            square = start + 0.15 * np.array([0 * right, right, right + down, down])
            errors.append(np.abs(view.project(square) - (quad[0] + 0.5)).mean())
    assert len(errors) >= 4
    assert max(errors) < 2.5, "corners are whole pixels without refinement"
    assert np.mean(errors) < 1.0


def test_resume_gives_the_same_bytes(tmp_path: Path) -> None:
    recipe = tiny_recipe(photos=2, size=(160, 120))
    generate(tmp_path / "a", recipe)
    first = {p.name: p.read_bytes() for p in sorted((tmp_path / "a" / "photos").iterdir())}
    assert generate(tmp_path / "a", recipe)["rendered"] == 0
    (tmp_path / "a" / "photos" / "IMG_0001.jpg").unlink()
    generate(tmp_path / "a", recipe)
    again = {p.name: p.read_bytes() for p in sorted((tmp_path / "a" / "photos").iterdir())}
    assert first == again
    with pytest.raises(InputError, match="seed"):
        generate(tmp_path / "a", tiny_recipe(photos=2, size=(160, 120), seed=1))
    # A gym of before a setting existed is one with that setting at its default.
    path = tmp_path / "a" / "truth" / "recipe.json"
    old = json.loads(path.read_text())
    del old["gym"]["round_volumes"]
    path.write_text(json.dumps(old))
    assert generate(tmp_path / "a", recipe)["rendered"] == 0
    (tmp_path / "b").mkdir()
    (tmp_path / "b" / "notes.txt").write_text("mine")
    with pytest.raises(InputError, match="empty"):
        generate(tmp_path / "b", recipe)


@pytest.mark.slow
def test_colmap_registers_the_tiny_gym(tiny_gym: Path, tmp_path: Path) -> None:
    from walltopo.geometry.colmap import pycolmap

    database = tmp_path / "database.db"
    pycolmap.extract_features(
        database,
        tiny_gym / "photos",
        camera_mode=pycolmap.CameraMode.SINGLE,
        reader_options=pycolmap.ImageReaderOptions(camera_model="SIMPLE_RADIAL"),
    )
    pycolmap.match_exhaustive(database)
    models = pycolmap.incremental_mapping(database, tiny_gym / "photos", tmp_path)
    model = max(models.values(), key=lambda m: m.num_reg_images())
    assert model.num_reg_images() == 8
    truth = np.load(tiny_gym / "truth" / "gt.npz")["cam_from_world"]
    images = [image for image in model.images.values() if image.has_pose]
    found = np.array([image.projection_center() for image in images])
    poses = [truth[int(image.name[4:8])] for image in images]
    centres = np.array([-p[:, :3].T @ p[:, 3] for p in poses])
    fit = pycolmap.estimate_sim3d(found, centres).matrix()
    error = np.linalg.norm(found @ fit[:, :3].T + fit[:, 3] - centres, axis=1)
    assert np.median(error) < 0.01


def _arguments(*words: str) -> argparse.Namespace:
    parser = argparse.ArgumentParser()
    synth_cli.register(parser.add_subparsers())
    return parser.parse_args(["synth", *words])


def test_options_become_a_recipe(tiny_gym: Path) -> None:
    recipe = synth_cli._recipe_of(
        _arguments("x", "--preset", "lead", "--seed", "5", "--size", "800x600", "--photos", "9")
    )
    assert (recipe.preset, recipe.seed, recipe.gym.height) == ("lead", 5, 11.0)
    assert (recipe.photos.photos, recipe.photos.width, recipe.photos.height) == (9, 800, 600)
    reset = synth_cli._recipe_of(_arguments("x", "--reset-of", str(tiny_gym), "--reset-seed", "3"))
    assert reset.gym == tiny_recipe().gym
    assert (reset.seed, reset.reset_seed, reset.photo_seed) == (0, 3, 3)
    changed = synth_cli._recipe_of(_arguments("x", "--set", "photo.noise=2", "--set", "spray=true"))
    assert changed.photos.noise == 2.0
    assert changed.gym.spray


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("x", "--set", "widht=3"), "Did you mean width"),
        (("x", "--set", "columns=three"), "expected a int"),
        (("x", "--size", "big"), "WIDTHxHEIGHT"),
    ],
)
def test_wrong_options_are_explained(words: tuple[str, ...], message: str) -> None:
    with pytest.raises(SettingsError) as caught:
        synth_cli._recipe_of(_arguments(*words))
    assert message in str(caught.value)


def test_a_new_folder_may_hold_the_mark_of_its_command_alone(tmp_path: Path) -> None:
    claimed_folder(Target(tmp_path / "gym", "OUT", "synth"))
    _check_folder(tmp_path / "gym", tiny_recipe())
    assert (tmp_path / "gym" / "truth" / "recipe.json").is_file()
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "diary.txt").write_text("mine")
    with pytest.raises(InputError, match="not empty"):
        _check_folder(tmp_path / "other", tiny_recipe())


def test_photo_settings_have_an_order() -> None:
    with pytest.raises(SettingsError, match="distance_low"):
        PhotoSettings(distance_low=5.0)
