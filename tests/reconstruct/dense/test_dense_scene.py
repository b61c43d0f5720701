"""Stereo, fusion and texture on a rendered scene: a wall with a box, seen by five cameras."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from walltopo.core import Camera, Mesh, Silent, StageError, View
from walltopo.geometry.mesh_check import check_mesh
from walltopo.geometry.zbuffer import render_ids
from walltopo.reconstruct.dense.depth_maps import DepthMap, keep_confirmed, merge_pair_depths
from walltopo.reconstruct.dense.marching_cubes import extract
from walltopo.reconstruct.dense.neighbours import (
    _choose_covering_rows,
    _shared_points,
    choose_neighbours,
)
from walltopo.reconstruct.dense.rectify import opencv_matrix, rectify
from walltopo.reconstruct.dense.scene import Scene, median_pixel_size, preview_mesh
from walltopo.reconstruct.dense.sgm import depth_maps, sgm_mesh
from walltopo.reconstruct.dense.stereo import clipped_mask, undistort
from walltopo.reconstruct.dense.tsdf import find_space, fuse
from walltopo.reconstruct.settings import DenseSettings, TextureSettings
from walltopo.reconstruct.texture.atlas import make_texture
from walltopo.reconstruct.texture.candidates import find_candidates

Floats = NDArray[np.float64]
Image = NDArray[np.uint8]

CAMERA = Camera("SIMPLE_RADIAL", 320, 240, (300.0, 160.0, 120.0, 0.03))
EXPOSURES = (1.0, 0.85, 1.1, 0.95, 1.05)
BOX = np.array([[-0.25, -0.15], [-0.2, 0.2], [-0.15, 0.0]])  # x, y and z range


def look_at(centre: Floats, target: Floats, camera: Camera = CAMERA) -> View:
    z = target - centre
    z = z / np.linalg.norm(z)
    x = np.cross([0.0, 1.0, 0.0], z)
    x = x / np.linalg.norm(x)
    rotation = np.stack([x, np.cross(z, x), z])
    return View("", camera, np.column_stack([rotation, -rotation @ centre]))


def wall_with_box() -> Mesh:
    """The wall z = 0 seen from z < 0, and a box that stands out of it."""
    (x0, x1), (y0, y1), (z0, z1) = BOX + np.array([[0, 0.25], [0, 0], [0, 0]])
    wall = np.array([[-2, -2, 0], [2, -2, 0], [2, 2, 0], [-2, 2, 0]], dtype=float)
    box = np.array([[x, y, z] for z in (z0, z1) for y in (y0, y1) for x in (x0, x1)])
    quads = [(0, 2, 3, 1), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    faces = [(0, 3, 2), (0, 2, 1)]
    for a, b, c, d in quads:
        faces += [(a + 4, b + 4, c + 4), (a + 4, c + 4, d + 4)]
    return Mesh(np.concatenate([wall, box]), np.array(faces, dtype=np.int32))


def pattern(points: Floats) -> Floats:
    """(n, 3) colours 0..255: sums of waves in all directions, fine and coarse."""
    rng = np.random.default_rng(5)
    total = np.zeros((len(points), 3))
    for wavelength in np.geomspace(0.035, 0.4, 12).repeat(4):
        direction = rng.normal(size=3)
        direction *= 2 * np.pi / wavelength / np.linalg.norm(direction)
        phase = rng.random(3) * 6.28
        total += np.sin((points @ direction)[:, None] + phase)
    return np.asarray(128 + 14 * total)


def draw(mesh: Mesh, view: View, exposure: float) -> Image:
    face_id, depth = render_ids(mesh.vertices, mesh.faces, view.camera, view.cam_from_world)
    plain = undistorted_rays(view.camera)
    points = (plain * depth[..., None] - view.cam_from_world[:, 3]) @ view.cam_from_world[:, :3]
    image = np.zeros((*face_id.shape, 3))
    seen = face_id >= 0
    image[seen] = pattern(points[seen]) * exposure
    return np.clip(image, 0, 255).astype(np.uint8)


def undistorted_rays(camera: Camera) -> Floats:
    """(H, W, 3) camera-frame rays of depth 1 through the pixels, by fixed-point iteration."""
    u, v = np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5)
    wanted = np.stack([u, v], axis=-1)
    rays = np.stack([(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, np.ones_like(u)], -1)
    for _ in range(8):
        error = camera.project(rays) - wanted
        rays[..., :2] -= error / [camera.fx, camera.fy]
    return rays


@cache
def scene() -> tuple[Scene, dict[str, Image], Mesh]:
    mesh = wall_with_box()
    centres = np.array(
        [[-0.35, 0, -2], [0.0, 0.05, -2.05], [0.35, 0, -2], [0.1, 0.3, -1.95], [-0.1, -0.3, -2]]
    )
    views = []
    for k, centre in enumerate(centres):
        turned = look_at(centre, np.array([0.6 * centre[0], 0.6 * centre[1], 0.0]))
        views.append(View(f"{k}.jpg", CAMERA, turned.cam_from_world))
    photos = {v.name: draw(mesh, v, e) for v, e in zip(views, EXPOSURES, strict=True)}
    rng = np.random.default_rng(3)
    wall = np.column_stack([rng.uniform(-0.9, 0.9, (500, 2)), np.zeros(500)])
    box = np.column_stack([rng.uniform([-0.2, -0.15], [0.05, 0.15], (60, 2)), np.full(60, -0.15)])
    points = np.concatenate([wall, box])
    seen = []
    for view in views:
        pixels = view.project(points)
        inside = ((pixels >= 0) & (pixels < [320, 240])).all(axis=1)
        seen.append(np.flatnonzero(inside))
    return Scene(tuple(views), points, tuple(seen)), photos, mesh


def grey(photos: dict[str, Image]) -> Callable[[str], Image]:
    return lambda name: photos[name].mean(axis=2).astype(np.uint8)


@cache
def reconstructed() -> Mesh:
    world, photos, _ = scene()
    settings_here = DenseSettings(min_part=0.3, max_hole=0.1)
    edge = 2.0 * median_pixel_size(world)
    return sgm_mesh(world, grey(photos), settings_here, edge, 1.0, Silent())


def distance_to_truth(points: Floats) -> Floats:
    """To the front of the wall and the box's faces, near enough for this scene."""
    from trimesh.triangles import closest_point

    truth = scene()[2]
    best = np.full(len(points), np.inf)
    for face in truth.faces:
        triangle = np.broadcast_to(truth.vertices[face], (len(points), 3, 3))
        gap = np.linalg.norm(closest_point(triangle, points) - points, axis=1)
        best = np.minimum(best, gap)
    return best


def test_the_mesh_is_accurate_complete_and_sound() -> None:
    mesh = reconstructed()
    pixel = median_pixel_size(scene()[0])
    gaps = distance_to_truth(mesh.vertices)
    assert np.median(gaps) < 0.75 * pixel
    assert np.percentile(gaps, 90) < 2.5 * pixel
    report = check_mesh(mesh, scene()[0].views)
    assert report.defects == []
    assert report.edge_length_median == pytest.approx(2.0 * pixel, rel=0.3)
    # the box's front and the wall beside it
    for x, y, z in ((-0.1, 0.0, -0.15), (0.4, 0.1, 0.0), (-0.5, -0.1, 0.0)):
        assert np.linalg.norm(mesh.vertices - [x, y, z], axis=1).min() < 2.0 * pixel


def test_hidden_pixels_have_no_depth() -> None:
    world, photos, _ = scene()
    partners = [[j for j in range(5) if j != k][:2] for k in range(5)]
    edge = 2.0 * median_pixel_size(world)
    mask = np.zeros((240, 320), dtype=np.bool_)
    mask[60:180, 100:200] = True

    def hidden(name: str) -> np.ndarray | None:
        return mask if name == "1.jpg" else None

    settings_here = DenseSettings(min_part=0.3, max_hole=0.1)
    arguments = world, grey(photos), partners, settings_here, edge, Silent()
    plain, without = list(depth_maps(*arguments)), list(depth_maps(*arguments, hidden))
    core = np.s_[65:175, 105:195]  # undistorted, the mask is not quite a rectangle
    assert (plain[1].depth[core] > 0).mean() > 0.5
    assert not without[1].depth[core].any()
    for k in (0, 2, 3, 4):
        assert np.array_equal(plain[k].depth, without[k].depth)


def test_hidden_pixels_paint_nothing() -> None:
    mesh = reconstructed()
    world, photos, _ = scene()
    mask = np.ones((240, 320), dtype=np.bool_)

    def hidden(name: str) -> np.ndarray | None:
        return mask if name == "1.jpg" else None

    plain = find_candidates(mesh, world.views, photos.__getitem__, Silent())
    without = find_candidates(mesh, world.views, photos.__getitem__, Silent(), hidden)
    assert (plain.view == 1).any()
    assert not (without.view == 1).any()
    assert (without.view == 0).sum() == (plain.view == 0).sum()


def test_the_texture_repeats_the_photos() -> None:
    mesh = reconstructed()
    world, photos, _ = scene()
    texture = make_texture(
        mesh, world.views, photos.__getitem__, TextureSettings(size=1024), Silent()
    )
    assert texture.uv.shape == (len(mesh.faces), 3, 2)
    assert texture.uv.min() >= 0
    assert texture.uv.max() <= 1
    assert (texture.label < 0).mean() < 0.05
    inside = (np.abs(mesh.centroids[:, :2]) < 0.5).all(axis=1) & (texture.label >= 0)
    middle = (texture.uv[inside].mean(axis=1) * 1024).astype(int)
    painted = texture.image[middle[:, 1], middle[:, 0]].astype(float)
    truth = pattern(mesh.centroids[inside])
    # exposures are levelled to a common one, which is not the truth's
    painted *= truth.mean(axis=0) / painted.mean(axis=0)
    error = np.abs(painted - truth).mean(axis=1)
    assert np.median(error) < 14


def test_levelling_makes_photos_of_different_exposure_agree() -> None:
    mesh = reconstructed()
    world, photos, _ = scene()
    spread = {}
    for blend in (True, False):
        options = TextureSettings(size=1024, blend=blend)
        texture = make_texture(mesh, world.views, photos.__getitem__, options, Silent())
        middle = (texture.uv.mean(axis=1) * 1024).astype(int)
        ratio = texture.image[middle[:, 1], middle[:, 0]].mean(axis=1) / pattern(
            mesh.centroids
        ).mean(axis=1)
        means = [np.median(ratio[texture.label == k]) for k in np.unique(texture.label) if k >= 0]
        spread[blend] = np.std(means)
    assert spread[True] < 0.5 * spread[False]


def test_the_preview_is_coarse_and_sound() -> None:
    world, _, _ = scene()
    mesh = preview_mesh(world, DenseSettings(), 2.0 * median_pixel_size(world), 1.0, Silent())
    assert check_mesh(mesh, world.views).defects == []
    assert len(mesh.faces) < len(reconstructed().faces) / 8
    assert np.percentile(distance_to_truth(mesh.vertices), 80) < 0.05


def test_without_overlap_there_is_a_clear_error() -> None:
    world, photos, _ = scene()
    apart = Scene(world.views[:2], world.points, (world.seen[0][:5], world.seen[1][-5:]))
    with pytest.raises(StageError, match="no two photos overlap"):
        sgm_mesh(apart, grey(photos), DenseSettings(), 0.02, 1.0, Silent())


def test_neighbours_are_near_and_not_oneself() -> None:
    world, _, _ = scene()
    partners = choose_neighbours(world, 3)
    assert all(0 < len(p) == len(set(p)) for p in partners)
    assert all(k not in p for k, p in enumerate(partners))
    assert all(k in partners[j] for k, p in enumerate(partners) for j in p)


@given(seed=st.integers(0, 10_000))
@settings(max_examples=20, deadline=None)
def test_views_know_how_many_points_they_share(seed: int) -> None:
    rng = np.random.default_rng(seed)
    view = scene()[0].views[0]
    seen = tuple(np.flatnonzero(rng.random(80) < rng.uniform(0, 0.7)) for _ in range(6))
    common = _shared_points(Scene((view,) * 6, np.zeros((80, 3)), seen)).toarray()
    for i, own in enumerate(seen):
        for j, other in enumerate(seen):
            shared = len(np.intersect1d(own, other))
            assert common[i, j] == (shared if i != j and shared >= 12 else 0)


def test_a_surface_made_in_parts_is_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    world, _, mesh = scene()
    maps = []
    for view in world.views:
        pinhole = View(view.name, view.camera.pinhole(), view.cam_from_world)
        _, depth = render_ids(mesh.vertices, mesh.faces, pinhole.camera, view.cam_from_world)
        depth = np.where(np.isfinite(depth), depth, 0).astype(np.float32)
        maps.append(DepthMap(depth, np.ones_like(depth), np.ones(depth.shape, np.uint8), pinhole))
    low, high = mesh.vertices.min(axis=0) - 0.1, mesh.vertices.max(axis=0) + 0.1
    space = find_space([(item.depth, item.view) for item in maps], low, high, 0.02, 0.08)
    whole = extract(fuse(space, maps, Silent()), 0.5)
    monkeypatch.setattr(
        "walltopo.reconstruct.dense.tsdf._MAX_BLOCKS_IN_MEMORY", len(space.blocks) // 4
    )
    parts = list(fuse(space, maps, Silent()))
    assert len(parts) == 5
    assert sum(part.own for part in parts) == len(space.blocks)
    again = extract(parts, 0.5)
    np.testing.assert_array_equal(again.vertices, whole.vertices)
    np.testing.assert_array_equal(again.faces, whole.faces)


@settings(max_examples=25, deadline=None)
@given(
    centre=st.tuples(*(st.floats(-0.5, 0.5) for _ in range(3))),
    target=st.tuples(st.floats(-0.3, 0.3), st.floats(-0.3, 0.3)),
    seed=st.integers(0, 1000),
)
def test_rectified_points_share_their_row_and_obey_the_disparity(
    centre: tuple[float, float, float], target: tuple[float, float], seed: int
) -> None:
    rng = np.random.default_rng(seed)
    points = rng.uniform([-0.8, -0.6, -0.2], [0.8, 0.6, 0.2], (80, 3))
    pinhole = CAMERA.pinhole()
    first = look_at(np.array([0.0, 0.0, -2.0]), np.zeros(3), pinhole)
    second = look_at(
        np.array([centre[0], centre[1], -2.0 + 0.5 * centre[2]]), np.array([*target, 0.0]), pinhole
    )
    if np.linalg.norm(second.centre - first.centre) < 0.05:
        return
    pair = rectify(first, second, points)
    if pair is None:
        return
    both = []
    for view, homography in ((first, pair.left), (second, pair.right)):
        q = view.to_camera(points) @ opencv_matrix(pinhole).T @ homography.T
        both.append(q[:, :2] / q[:, 2:])
    assert both[0][:, 1] == pytest.approx(both[1][:, 1], abs=1e-6)
    full = pair.plane[:2] @ both[0].T + pair.plane[2]
    full = full + pair.stretch * (both[0][:, 0] - both[1][:, 0])
    depth = (first.to_camera(points) @ pair.rotation.T)[:, 2]
    assert pair.scale / full == pytest.approx(depth, rel=1e-6)


def test_undistorted_photos_follow_the_pinhole() -> None:
    world, photos, mesh = scene()
    view = world.views[0]
    straight, pinhole = undistort(photos[view.name], view)
    wanted = draw(mesh, pinhole, 1.0)
    inner = np.s_[20:-20, 20:-20]
    assert np.abs(straight[inner].astype(float) - wanted[inner]).mean() < 6


def test_the_void_beside_a_wall_is_clipped_and_a_dark_spot_is_not() -> None:
    image = np.random.default_rng(1).integers(60, 90, (100, 160)).astype(np.uint8)
    image[:, 120:] = np.random.default_rng(2).integers(0, 5, (100, 40))
    image[10:20, 10:20] = 0
    image[40:80, 20:60] = 255
    found = clipped_mask(image)
    assert found[:, 120:].all()
    assert found[40:80, 20:60].all()
    assert found.sum() == 100 * 40 + 40 * 40


def test_depths_need_agreement() -> None:
    narrow = Camera("PINHOLE", 120, 120, (600.0, 600.0, 60.0, 60.0))
    here, left, right = (
        look_at(np.array([x, 0, -2.0]), np.zeros(3), narrow) for x in (0, -0.1, 0.1)
    )
    one = np.full((120, 120), 2.0, dtype=np.float32)
    other = one.copy()
    other[:60], other[60:, :60] = 2.01, 2.2
    other[:60, :60] = np.nan
    depth, weight, support = merge_pair_depths([one, other], here, [left, right])
    assert depth[:60, :60] == pytest.approx(2.0)
    assert depth[:60, 60:] == pytest.approx(2.005, abs=1e-3)
    assert depth[60:, 60:] == pytest.approx(2.0)
    # Both partners see the spot, and nothing decides whose depth is right.
    assert (depth[60:90, 40:60] == 0).all()
    assert ((weight > 0) == (depth > 0)).all()
    assert (support[70, 70], support[10, 70], support[10, 10], support[70, 50]) == (2, 2, 1, 0)


def test_a_pair_has_no_say_where_its_partner_does_not_look() -> None:
    pinhole = CAMERA.pinhole()
    here = look_at(np.array([0.0, 0.0, -2.0]), np.zeros(3), pinhole)
    near, aside = (
        look_at(np.array([x, 0.0, -2.0]), np.array([t, 0.0, 0.0]), pinhole)
        for x, t in ((0.1, 0.0), (0.5, 0.9))
    )
    shape = (pinhole.height, pinhole.width)
    wall, false = np.full(shape, 2.0, np.float32), np.full(shape, 1.2, np.float32)
    depth, _, support = merge_pair_depths([wall, false], here, [near, aside])
    u = np.arange(pinhole.width) + 0.5
    points = np.column_stack([(u - pinhole.cx) / pinhole.fx * 2.0, 0 * u, 0 * u])
    seen = aside.project(points)[:, 0]
    outside, inside = (seen < 0) & (u > 100), (seen > 40) & (u < 280)
    middle = depth[pinhole.height // 2]
    assert outside.sum() > 40
    assert inside.sum() > 40
    assert middle[outside] == pytest.approx(2.0)
    assert (support[pinhole.height // 2][outside] == 1).all()
    assert not (middle[inside] == 2.0).any()


def test_a_partner_is_chosen_for_what_the_others_leave() -> None:
    # The third row sees only two points, but no other row sees them; the second repeats the first.
    worth = np.array([[1, 1, 1, 1, 0, 0], [0.9, 0.9, 0.9, 0.9, 0, 0], [0, 0, 0, 0, 1, 1]], float)
    assert _choose_covering_rows(worth, np.eye(3), 2) == [0, 2]
    assert _choose_covering_rows(worth, np.eye(3), 5) == [0, 2, 1]
    assert _choose_covering_rows(np.zeros((3, 6)), np.eye(3), 2) == []


def test_depths_of_one_pair_need_another_photo_and_those_of_two_need_no_contradiction() -> None:
    here = look_at(np.array([0.0, 0.0, -2.0]), np.zeros(3), CAMERA.pinhole())
    shape = (here.camera.height, here.camera.width)
    flat = np.full(shape, 2.0, dtype=np.float32)
    weight = np.full(shape, 1.0, dtype=np.float32)
    pairs = np.ones(shape, dtype=np.uint8)
    pairs[:, 100:200] = 2
    other = flat.copy()
    other[:80], other[80:160] = 0.0, 3.0  # silent above, seeing through in the middle
    maps = [DepthMap(flat, weight, pairs, here), DepthMap(other, weight, pairs, here)]
    kept = keep_confirmed(0, maps, [1], 0.01, 2).depth > 0
    assert kept[:80].all(axis=0).tolist() == (pairs[0] == 2).tolist()
    assert not kept[80:160].any()
    assert kept[160:].all()
    assert (keep_confirmed(0, maps, [1], 0.01, 0).depth > 0)[:80].all()
