"""The benchmark of ordinary photos judges poses, and draws the same photos for a seed."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from benchmarks.ordinary_photos import GYM, PHOTOS, Placed, make_wall, placed_row, right_photos
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from walltopo.images.files import read_rgb

Floats = NDArray[np.float64]


def poses(rng: np.random.Generator, count: int) -> dict[str, Floats]:
    rotations = Rotation.random(count, rng=rng).as_matrix()
    centres = rng.uniform(0, 5, (count, 3, 1))
    return {
        f"{k}.jpg": np.concatenate([rotation, -rotation @ centre], axis=1)
        for k, (rotation, centre) in enumerate(zip(rotations, centres, strict=True))
    }


def in_other_frame(pose: Floats) -> Floats:
    """The pose in a world that is turned, moved and twice as large."""
    turn = Rotation.from_euler("xyz", [20, 50, -70], degrees=True).as_matrix()
    rotation = pose[:, :3] @ turn.T
    centre = 2 * turn @ (-pose[:, :3].T @ pose[:, 3]) + np.array([1.0, 2.0, 3.0])
    return np.column_stack([rotation, -rotation @ centre])


def test_wrong_cameras_change_nothing_for_right_ones() -> None:
    truth = poses(np.random.default_rng(0), 8)
    found = {name: in_other_frame(pose) for name, pose in truth.items()}
    found["2.jpg"] = found["2.jpg"] + np.array([0, 0, 0, 0.5])  # moved
    turn = Rotation.from_euler("x", 10, degrees=True).as_matrix()
    found["5.jpg"] = turn @ found["5.jpg"]  # turned on the spot
    assert right_photos(found, truth) == truth.keys() - {"2.jpg", "5.jpg"}
    assert right_photos({"0.jpg": found["0.jpg"]}, truth) == set()


@pytest.mark.slow
def test_a_wall_and_its_row(tmp_path: Path) -> None:
    gym = replace(GYM, width=3.0, columns=2, routes=2, volumes=0)
    photos = replace(PHOTOS, photos=3, width=96, height=128, samples=1)
    wall = make_wall(tmp_path, 1, gym, photos)
    assert [read_rgb(file).shape for file in wall.files] == 3 * [(128, 96, 3)]
    assert np.allclose(np.diag(wall.overlaps), 1)
    found = {name: in_other_frame(pose) for name, pose in wall.truth.items()}
    pairs = {"learned": [("1-00.jpg", "1-01.jpg")]}
    row = placed_row("1", Placed(found, 70, 12.3, "learned", pairs), wall)
    both = max(wall.overlaps[0, 1], wall.overlaps[1, 0]) > 0.02
    cell = "1 + 0 false" if both else "0 + 1 false"
    assert row == f"| 1 | 3 | 3 | 3 | 0 | 70 | 12 | learned | {cell} |  |"
