"""Photos that the others contradict paint nothing."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from walltopo.geometry.topology import face_neighbours
from walltopo.reconstruct.texture.candidates import Candidates
from walltopo.reconstruct.texture.consistency import leave_out_contradicted

SIDE = 60  # squares of a wall, each of two triangles
WALL, PERSON, HOLD = (150, 140, 120), (60, 50, 90), (110, 100, 120)


def wall_faces() -> NDArray[np.int32]:
    """Return the (2 * SIDE * SIDE, 3) triangles of a square wall, row by row."""
    corner = np.arange(SIDE * (SIDE + 1)).reshape(SIDE, SIDE + 1)[:, :-1].reshape(-1)
    first = np.stack([corner, corner + 1, corner + SIDE + 1], axis=1)
    second = np.stack([corner + 1, corner + SIDE + 2, corner + SIDE + 1], axis=1)
    return np.stack([first, second], axis=1).reshape(-1, 3).astype(np.int32)


def taken(photos: int) -> Candidates:
    """Return a wall of one colour as photos see it, with noise."""
    rng = np.random.default_rng(0)
    count = 2 * SIDE * SIDE
    view = np.full((count, 6), -1, dtype=np.int16)
    view[:, :photos] = rng.permuted(np.tile(np.arange(photos), (count, 1)), axis=1)
    colour = np.clip(rng.normal(WALL, 6.0, (count, 6, 3)), 0, 255).astype(np.uint8)
    return Candidates(view, np.ones((count, 6), np.float32), colour)


def part(low: int, high: int) -> NDArray[np.bool_]:
    """Return which triangles lie in the squares from `low` to `high` of both directions."""
    row, column = np.divmod(np.arange(2 * SIDE * SIDE) // 2, SIDE)
    return (row >= low) & (row < high) & (column >= low) & (column < high)


def show(
    candidates: Candidates,
    photo: int,
    where: NDArray[np.bool_],
    colour: tuple[int, int, int] = PERSON,
) -> None:
    """Let a photo show another colour at some triangles."""
    candidates.colour[(candidates.view == photo) & where[:, None]] = colour


def sees(candidates: Candidates, photo: int) -> NDArray[np.bool_]:
    """Return which triangles have a photo among their candidates."""
    return np.asarray((candidates.view == photo).any(axis=1))


def compare(candidates: Candidates, gains: NDArray[np.float64] | None = None) -> None:
    """Leave out what the photos contradict."""
    factors = np.ones((6, 3)) if gains is None else gains
    leave_out_contradicted(candidates, factors, face_neighbours(wall_faces()))


@pytest.mark.parametrize("photos", [3, 4, 6])
def test_a_person_in_one_photo_paints_nothing(photos: int) -> None:
    candidates = taken(photos)
    show(candidates, 1, part(20, 40))
    compare(candidates)
    assert not sees(candidates, 1)[part(22, 38)].any()
    assert sees(candidates, 1)[~part(17, 43)].all()
    assert all(sees(candidates, other).all() for other in range(photos) if other != 1)


def test_two_photos_do_not_tell_which_is_right() -> None:
    candidates = taken(2)
    show(candidates, 1, part(20, 40))
    compare(candidates)
    assert sees(candidates, 0).all()
    assert sees(candidates, 1).all()


def test_the_border_of_a_hold_that_is_off_stays() -> None:
    candidates = taken(5)
    one_triangle_wide = np.arange(2 * SIDE * SIDE) % 2 == 0
    show(candidates, 1, part(20, 40) & ~part(21, 39) & one_triangle_wide, HOLD)
    compare(candidates)
    assert sees(candidates, 1).all()


def test_a_darker_photo_stays() -> None:
    candidates, gains = taken(4), np.ones((6, 3))
    dark = candidates.view == 2
    candidates.colour[dark] = candidates.colour[dark] // 2
    gains[2] = 2.0
    compare(candidates, gains)
    assert sees(candidates, 2).all()


def test_every_triangle_keeps_a_photo() -> None:
    candidates = taken(6)
    for photo, shade in enumerate((0, 50, 100, 150, 200, 250)):
        candidates.colour[candidates.view == photo] = shade
    compare(candidates)
    assert (candidates.view >= 0).any(axis=1).all()
