"""Photos that a model does not hold leave it, and a weak model is no basis for a mesh."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from walltopo.core import StageError
from walltopo.reconstruct.sparse.weak_photos import (
    WEAK_POINTS,
    check_strength,
    drop_barely_linked,
    drop_weak_photos,
    own_points,
    roll_angles,
)


def model(shown: dict[str, set[int]], rolls: dict[str, float] | None = None) -> Any:
    """A model of photos that look along z; each shows the points of a set."""
    from walltopo.geometry.colmap import pycolmap

    made = pycolmap.Reconstruction()
    camera = pycolmap.Camera(
        model="PINHOLE", width=100, height=100, params=[90.0, 90.0, 50.0, 50.0], camera_id=1
    )
    made.add_camera_with_trivial_rig(camera)
    total = 1 + max(point for points in shown.values() for point in points)
    for number, name in enumerate(shown, start=1):
        image = pycolmap.Image(
            name=name, keypoints=np.zeros((total, 2)), camera_id=1, image_id=number
        )
        angle = np.radians((rolls or {}).get(name, 0.0))
        turn = np.array(
            [[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1.0]]
        )
        pose = pycolmap.Rigid3d(pycolmap.Rotation3d(turn), np.array([0.1 * number, 0, 0]))
        made.add_image_with_trivial_frame(image, pose)
    rng: NDArray[np.float64] = np.random.default_rng(0).uniform(-1, 1, (total, 3))
    for point in range(total):
        track = [
            pycolmap.TrackElement(number, point)
            for number, points in enumerate(shown.values(), start=1)
            if point in points
        ]
        if len(track) > 1:
            made.add_point3D(rng[point], pycolmap.Track(track))
    return made


def test_a_photo_without_points_of_its_own_leaves_the_model() -> None:
    made = model({"a": set(range(200)), "b": set(range(200)), "c": set(range(7))})
    assert own_points(made) == {"a": 200, "b": 200, "c": 7}
    dropped = drop_weak_photos(made)
    assert list(dropped) == ["c"]
    assert dropped["c"].startswith("only 7 of its points")
    assert own_points(made) == {"a": 200, "b": 200}


def test_a_photo_that_a_dropped_one_held_leaves_too() -> None:
    made = model(
        {
            "a": {*range(50)},
            "b": {*range(50)},
            "c": {*range(10), *range(60, 64)},
            "d": {*range(60, 75)},
        }
    )
    assert set(drop_weak_photos(made)) == {"c", "d"}


@pytest.mark.parametrize(
    ("points", "roll", "stays"),
    [(40, 66.0, False), (40, -100.0, False), (40, 30.0, True), (100, 90.0, True)],
)
def test_few_points_must_agree_with_the_up_direction(
    points: int, roll: float, *, stays: bool
) -> None:
    shown = {name: set(range(200)) for name in "abc"} | {"d": set(range(points))}
    made = model(shown, {"d": roll})
    assert roll_angles(made)["d"] == pytest.approx(abs(roll))
    assert ("d" not in drop_weak_photos(made)) == stays


def test_a_weak_model_is_refused_with_its_number() -> None:
    few = model({name: set(range(WEAK_POINTS - 1)) for name in "abc"})
    with pytest.raises(StageError, match="59 in all, 59 in the median photo, 60") as refused:
        check_strength(few, accept_weak=False)
    assert "sparse.accept_weak" in (refused.value.hint or "")
    assert check_strength(few, accept_weak=True) == WEAK_POINTS - 1
    enough = model({name: set(range(WEAK_POINTS)) for name in "abc"})
    assert check_strength(enough, accept_weak=False) == WEAK_POINTS


def test_a_group_that_few_points_join_leaves_the_model() -> None:
    made = model(
        {
            "a": {*range(100)},
            "b": {*range(50, 150)},
            "c": {*range(120, 220)},
            "d": {*range(200, 320)},  # 20 points of c
            "e": {*range(220, 340)},
        }
    )
    dropped = drop_barely_linked(made)
    assert list(dropped) == ["d", "e"]
    assert dropped["d"].startswith("only 20 points link it")
    assert set(own_points(made)) == {"a", "b", "c"}
    assert drop_barely_linked(made) == {}


def test_a_model_of_no_links_keeps_a_photo() -> None:
    assert list(drop_barely_linked(model({"a": {0, 1}, "b": {1, 2}}))) == ["b"]
