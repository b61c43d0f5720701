"""The texture's parts: gains, seams, filling."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from walltopo.geometry.topology import face_neighbours, patches
from walltopo.images.fill import fill_gaps
from walltopo.reconstruct.texture.atlas import _faces_by_label
from walltopo.reconstruct.texture.candidates import Candidates, choose_labels
from walltopo.reconstruct.texture.colour import level_seams, photo_gains
from walltopo.reconstruct.texture.paint import paint_photo
from walltopo.reconstruct.texture.unseen import spread_colours, unseen_cells


def test_gains_undo_exposures() -> None:
    rng = np.random.default_rng(0)
    exposure = np.array([[1.0, 1.0, 1.0], [0.7, 0.75, 0.8], [1.2, 1.1, 1.15]])
    truth = rng.uniform(60, 180, (4000, 3))
    view = np.argsort(rng.random((4000, 3)), axis=1)[:, :2].astype(np.int16)
    colour = np.stack([truth * exposure[view[:, k]] for k in range(2)], axis=1)
    candidates = Candidates(view, np.ones(view.shape, np.float32), colour.astype(np.uint8))
    levelled = photo_gains(candidates, 3) * exposure
    assert levelled == pytest.approx(np.broadcast_to(levelled[0], (3, 3)), rel=0.02)


def strip(count: int) -> np.ndarray:
    """A strip of 2 * count triangles between two rows of vertices."""
    lower, upper = np.arange(count), np.arange(count) + count + 1
    first = np.stack([lower, lower + 1, upper], axis=1)
    second = np.stack([lower + 1, upper + 1, upper], axis=1)
    return np.stack([first, second], axis=1).reshape(-1, 3).astype(np.int32)


def test_labels_are_patches_and_follow_the_better_photo() -> None:
    faces = strip(200)
    n = len(faces)
    rng = np.random.default_rng(2)
    slope = np.linspace(-2, 2, n)
    score = np.exp(np.stack([-slope, slope], axis=1) + rng.normal(scale=0.5, size=(n, 2)))
    view = np.tile(np.array([0, 1], dtype=np.int16), (n, 1))
    candidates = Candidates(view, score.astype(np.float32), np.zeros((n, 2, 3), np.uint8))
    adjacent = face_neighbours(faces)
    label = choose_labels(candidates, adjacent, 1.0)
    best = score.argmax(axis=1).astype(np.int16)
    count = len(patches(adjacent, label)[1])
    assert count < len(patches(adjacent, best)[1]) / 2
    assert label[:100].mean() < 0.1
    assert label[-100:].mean() > 0.9


def test_seams_close_and_fade() -> None:
    count = 60
    faces = strip(count)
    left = np.arange(len(faces)) < len(faces) // 2
    keys = faces.astype(np.int64) * 2 + np.where(left, 0, 1)[:, None]
    unique, inverse = np.unique(keys, return_inverse=True)
    vertex, side = unique // 2, unique % 2
    colour = np.where(side[:, None] == 0, 100.0, 120.0) * np.ones(3)
    shift = level_seams(inverse.reshape(-1, 3).astype(np.int32), vertex, colour)
    total = colour + shift
    order = np.argsort(vertex, kind="stable")
    same = vertex[order[1:]] == vertex[order[:-1]]
    gap = np.abs(total[order[1:]][same] - total[order[:-1]][same])
    assert gap.max() < 4
    assert np.abs(shift).max() == pytest.approx(10.0, abs=2.0)


def test_unknown_colours_spread_from_known_ones() -> None:
    faces = strip(10)
    colours = spread_colours(faces, 22, np.array([0, 10]), np.array([[0.0] * 3, [100.0] * 3]))
    assert colours[0] == pytest.approx(0.0)
    assert colours[10] == pytest.approx(100.0)
    assert (np.diff(colours[:11, 0]) >= -1e-9).all()


def test_cells_of_unseen_triangles_do_not_overlap() -> None:
    corners, side = unseen_cells(7)
    assert corners.max() < side
    assert len(np.unique(corners[:, 0].astype(int), axis=0)) == 7
    assert unseen_cells(0)[1] == 0


def test_gaps_take_the_nearest_colour() -> None:
    atlas = np.zeros((8, 8, 3), dtype=np.uint8)
    painted = np.zeros((8, 8), dtype=np.bool_)
    atlas[1, 1], painted[1, 1] = (10, 20, 30), True
    atlas[6, 6], painted[6, 6] = (200, 100, 50), True
    filled = fill_gaps(atlas, painted)
    assert filled[0, 0].tolist() == [10, 20, 30]
    assert filled[7, 7].tolist() == [200, 100, 50]


def test_the_last_triangle_has_the_last_word_whatever_the_threads_do() -> None:
    """Triangles of the second half lie on those of the first, whose thread is kept busy before."""
    part, side = 300, 512
    place = np.stack([np.arange(part) % 25, np.arange(part) // 25], axis=1) * 10.0
    small = place[:, None, :] + [[0, 0], [9, 0], [0, 9]]
    large = np.broadcast_to([[260.0, 260.0], [500.0, 260.0], [260.0, 500.0]], small.shape)
    apart = small + [0.0, 260.0]
    texels = np.concatenate([large, small, small, apart]).astype(np.float32)
    correction = np.array([[0.0] * 3, [100.0] * 3], dtype=np.float32)
    node = np.zeros((len(texels), 3), dtype=np.int32)
    node[2 * part :] = 1
    photo = np.full((8, 8, 3), 50, dtype=np.uint8)
    pixels = np.full((len(texels), 3, 2), 4.0, dtype=np.float32)
    gain, which = np.ones(3, dtype=np.float32), np.arange(len(texels))
    atlas = np.zeros((side, side, 3), dtype=np.uint8)
    painted = np.zeros((side, side), dtype=np.uint8)
    paint_photo(photo, gain, which, pixels, texels, node, correction, atlas, painted)
    assert set(np.unique(atlas[:250, :250][painted[:250, :250] == 1])) == {150}


@given(label=st.lists(st.integers(-1, 4), max_size=40))
def test_triangles_by_label(label: list[int]) -> None:
    labels = np.array(label, dtype=np.int16)
    by_label = _faces_by_label(labels, 5)
    assert len(by_label) == 5
    for k, faces in enumerate(by_label):
        np.testing.assert_array_equal(faces, np.flatnonzero(labels == k))
