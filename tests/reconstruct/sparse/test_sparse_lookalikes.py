"""Models that join places which merely look alike are refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from walltopo.reconstruct.sparse.lookalikes import (
    are_connected,
    are_observed,
    models_agree,
    observed_shares,
)


def test_a_model_that_contradicts_the_one_before_is_reported() -> None:
    rng = np.random.default_rng(0)
    known = {f"{k}.jpg": place for k, place in enumerate(rng.normal(size=(9, 3)))}
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    turn *= np.sign(np.linalg.det(turn))
    moved = {name: 3 * turn @ place + 1 for name, place in known.items()}
    more = moved | {"new.jpg": np.zeros(3)}
    assert models_agree(known, more)
    folded = {name: at * [1, 1, -1] if at[0] > 0 else at for name, at in known.items()}
    assert not models_agree(known, folded)
    assert models_agree(known, {"other.jpg": np.zeros(3)}), "nothing in common: nothing is known"
    assert models_agree(dict.fromkeys(known, np.ones(3)), moved), (
        "cameras in one place tell nothing"
    )


def test_what_hangs_on_one_thing_is_not_tied() -> None:
    """Two rooms with the same printed measure, which everything else of both tells apart."""
    from walltopo.geometry.colmap import pycolmap

    def model(shared: NDArray[np.float64]) -> Any:
        made = pycolmap.Reconstruction()
        camera = pycolmap.Camera(
            model="PINHOLE", width=100, height=100, params=[90.0, 90.0, 50.0, 50.0], camera_id=1
        )
        made.add_camera_with_trivial_rig(camera)
        rng = np.random.default_rng(0)
        own = [rng.uniform(-1, 1, (80, 3)) for _ in "ab"]
        for number, name in ((1, "a.jpg"), (2, "b.jpg")):
            image = pycolmap.Image(
                name=name,
                keypoints=np.zeros((80 + len(shared), 2)),
                camera_id=1,
                image_id=number,
            )
            made.add_image_with_trivial_frame(image, pycolmap.Rigid3d())
        element = pycolmap.TrackElement
        for k, place in enumerate(shared):
            made.add_point3D(place, pycolmap.Track([element(1, 80 + k), element(2, 80 + k)]))
        for number, places in enumerate(own, start=1):
            for k, place in enumerate(places):
                made.add_point3D(place, pycolmap.Track([element(number, k)]))
        return made

    spots = np.random.default_rng(1).uniform(-1, 1, (40, 3))
    assert are_connected(model(spots), ["a.jpg"])
    assert not are_connected(model(0.1 * spots), ["a.jpg"]), "all in one place"
    assert not are_connected(model(spots[:5]), ["a.jpg"]), "too few"
    assert are_connected(model(spots[:5]), ["a.jpg", "b.jpg"]), "nothing new"


def _wall(observed: float) -> Any:
    """Three photos of 200 points on a wall at 3 m; the third observes a share of them."""
    from walltopo.geometry.colmap import pycolmap

    made = pycolmap.Reconstruction()
    camera = pycolmap.Camera(
        model="PINHOLE", width=100, height=100, params=[90.0, 90.0, 50.0, 50.0], camera_id=1
    )
    made.add_camera_with_trivial_rig(camera)
    places = np.column_stack([np.random.default_rng(0).uniform(-1, 1, (200, 2)), np.full(200, 3.0)])
    for number in (1, 2, 3):
        image = pycolmap.Image(
            name=f"{number}.jpg", keypoints=np.zeros((200, 2)), camera_id=1, image_id=number
        )
        pose = pycolmap.Rigid3d(pycolmap.Rotation3d(), np.array([0.1 * number, 0, 0]))
        made.add_image_with_trivial_frame(image, pose)
    element = pycolmap.TrackElement
    for k, place in enumerate(places):
        photos = (1, 2, 3) if k < observed * len(places) else (1, 2)
        made.add_point3D(place, pycolmap.Track([element(number, k) for number in photos]))
    return made


@pytest.mark.parametrize("observed", [0.0, 0.05, 0.5, 1.0])
def test_a_photo_in_its_place_shows_what_it_should(observed: float) -> None:
    known = ["1.jpg", "2.jpg"]
    model = _wall(observed)
    assert observed_shares(model, known)["3.jpg"] == pytest.approx(observed, abs=0.03)
    assert are_observed(model, known) == (observed >= 0.1)


def test_a_photo_of_another_part_says_nothing() -> None:
    model = _wall(0.0)
    assert np.isnan(observed_shares(model, ["1.jpg"])["3.jpg"]), "no point with two known photos"
    assert are_observed(model, ["1.jpg"])
    assert are_observed(model, ["1.jpg", "2.jpg", "3.jpg"]), "nothing new"
