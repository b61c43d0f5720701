"""A hall: several walls around a floor, each as it would be alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from walltopo.core import Camera, SettingsError, View
from walltopo_lab.synth import GymSettings, PhotoSettings, make_gym
from walltopo_lab.synth.gym import Gym, Reset, SetUp, set_up
from walltopo_lab.synth.hall import moved_pose, ring_of_walls
from walltopo_lab.synth.path import phone_camera, walk_hall
from walltopo_lab.synth.truth import count_views, scene_record

ALONE = GymSettings(
    width=2.4,
    height=2.2,
    columns=3,
    overhang_max_deg=10.0,
    facets=0.3,
    volumes=1,
    routes=2,
    holds_low=3,
    holds_high=4,
    downclimb=1,
    lamps=1,
    plates=2,
    cell=0.2,
    detail=0.3,
)
HALL = replace(ALONE, walls=6)
PHOTOS = PhotoSettings(photos=48, width=64, height=64, distance_low=1.8, distance_high=2.2)


@pytest.fixture(scope="module")
def built() -> SetUp:
    return set_up(HALL, 3)


@pytest.fixture(scope="module")
def hall() -> Gym:
    return make_gym(HALL, 3)


@given(walls=st.integers(4, 80), width=st.floats(1.5, 20))
@settings(max_examples=40, deadline=None)
def test_walls_stand_beside_each_other_and_look_inwards(walls: int, width: float) -> None:
    stands = ring_of_walls(walls, width)
    for k, stand in enumerate(stands):
        move, following = stand.hall_from_wall, stands[(k + 1) % walls]
        begin, end = move.apply(np.array([[0.0, 0.0, 0.0], [width, 0.0, 0.0]]))
        np.testing.assert_allclose(move.apply(stand.middle), 0, atol=1e-9)
        facing = move.rotation @ np.array([0.0, -1.0, 0.0])
        assert facing @ ((begin + end) / 2) < 0, "away from the middle"
        after = following.hall_from_wall.apply(np.zeros(3))
        joint = move.apply(stand.joint)
        assert np.linalg.norm(end - after) > 0.7, "a metre along each side, around the corner"
        np.testing.assert_allclose(np.linalg.norm(end - joint), np.linalg.norm(after - joint))


def test_the_first_wall_is_the_gym_of_that_seed(built: SetUp) -> None:
    alone = set_up(replace(ALONE, plates=1), 3)
    for one, two in zip(alone.wall, built.sections[0].wall, strict=True):
        np.testing.assert_array_equal(one.corners, two.corners)
    move = built.sections[0].hall_from_wall
    first = [item for item in built.instances if item.id <= len(alone.instances)]
    by_id = {item.id: item for item in alone.instances}
    assert len(first) == len(by_id)
    for item in first:
        np.testing.assert_allclose(item.position, move.apply(by_id[item.id].position))
        assert item.route == by_id[item.id].route


def test_ids_and_routes_count_on_from_wall_to_wall(built: SetUp) -> None:
    ids = [item.id for item in built.instances]
    assert len(set(ids)) == len(ids)
    routes = {item.route for item in built.holds if item.route >= 0}
    assert routes == set(range(HALL.walls * HALL.routes))
    volumes = {facet.instance for facet in built.facets} - {0}
    assert volumes == {item.id for item in built.volumes}
    assert sorted(plate.style for plate in built.plates) == [0, 1]
    for hold in built.holds:
        assert any(abs((hold.position - f.corners[0]) @ f.frame[2]) < 0.05 for f in built.facets)


def test_a_hall_of_two_walls_and_a_reset_of_a_hall_are_refused() -> None:
    with pytest.raises(SettingsError, match="walls"):
        replace(ALONE, walls=2)
    with pytest.raises(SettingsError, match="one wall"):
        set_up(HALL, 3, Reset(1))


@pytest.mark.slow
def test_photos_show_wall_after_wall_and_the_gaps_between(hall: Gym) -> None:
    poses = walk_hall(hall.sections, HALL, PHOTOS, np.random.default_rng(0))
    assert len(poses) == PHOTOS.photos
    per_wall = PHOTOS.photos // HALL.walls
    linking = 0
    for k, pose in enumerate(poses):
        view = View(str(k), phone_camera(PHOTOS), pose)
        eye, way = view.centre[None].astype(np.float32), view.direction[None].astype(np.float32)
        hit = view.centre + view.direction * float(hall.tracer.distances(eye, way)[0])
        stand = hall.sections[k // per_wall].stand
        assert stand is not None
        here = stand.hall_from_wall.inverse().apply(hit)
        if k % per_wall < per_wall - per_wall // 4:
            assert -0.5 < here[0] < HALL.width + 0.5
            assert here[1] > -1.6, "the wall or the measure before it"
        else:
            linking += 1
            assert np.linalg.norm((here - stand.joint)[:2]) < 3
    assert linking == 2 * HALL.walls
    length = scene_record(hall, "", [])["wall_length_m"]
    assert 0.8 < length / (HALL.walls * HALL.width) < 1.01


def test_faces_that_no_block_of_a_photo_holds_are_not_looked_at_and_none_is_missed(
    hall: Gym,
) -> None:
    camera = Camera("SIMPLE_RADIAL", 64, 48, (47.0, 32.0, 24.0, 0.05))
    poses = walk_hall(hall.sections, HALL, replace(PHOTOS, photos=12), np.random.default_rng(1))
    counts = count_views(hall, camera, poses)
    surface = hall.surface
    corners = surface.vertices[surface.faces]
    centroids = corners.mean(axis=1)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    expected = np.zeros(len(centroids), np.int32)
    for pose in poses:
        view = View("", camera, pose)
        pixels = view.project(centroids)
        with np.errstate(invalid="ignore"):
            framed = ((pixels >= 0) & (pixels < [64, 48])).all(axis=1)
        framed &= ((view.centre - centroids) * normals).sum(axis=1) > 0
        ray = centroids - view.centre
        length = np.linalg.norm(ray, axis=1)
        origins = np.tile(view.centre.astype(np.float32), (len(ray), 1))
        far = hall.tracer.distances(origins, (ray / length[:, None]).astype(np.float32))
        expected += framed & (far > length - 2e-4)
    np.testing.assert_array_equal(counts, expected)
    assert counts.max() > 1


@given(turn=st.floats(-3, 3), x=st.floats(-5, 5), y=st.floats(-5, 5))
@settings(max_examples=30, deadline=None)
def test_a_moved_pose_sees_the_moved_point_where_it_saw_the_point(
    turn: float, x: float, y: float
) -> None:
    stand = ring_of_walls(7, 3.0)[3]
    c, s = np.cos(turn), np.sin(turn)
    pose = np.array([[c, s, 0, x], [-s, c, 0, y], [0, 0, 1, 1.0]])
    point = np.array([x, turn, y])
    moved = moved_pose(pose, stand.hall_from_wall)
    here = moved[:, :3] @ stand.hall_from_wall.apply(point) + moved[:, 3]
    np.testing.assert_allclose(here, pose[:, :3] @ point + pose[:, 3], atol=1e-9)
