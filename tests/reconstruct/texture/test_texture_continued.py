"""Guesses that no photo shows get the colours around them, and nothing else is repainted."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh
from walltopo.reconstruct.texture.paint import paint_photo
from walltopo.reconstruct.texture.unseen import continue_colours, plane_positions

SIDE = 120
CELLS = 12
STEP = 0.01


def sheet() -> Mesh:
    """A bumpy square sheet that looks along z."""
    axis = np.arange(CELLS + 1) * STEP
    x, y = np.meshgrid(axis, axis)
    points = np.column_stack([x.ravel(), y.ravel(), 0.02 * np.sin(40 * x.ravel())])
    a = (np.arange(CELLS)[:, None] * (CELLS + 1) + np.arange(CELLS)).ravel()
    over = a + CELLS + 1
    faces = np.vstack([np.column_stack([a, a + 1, over + 1]), np.column_stack([a, over + 1, over])])
    return Mesh(points, faces.astype(np.int32))


def charted(mesh: Mesh, gone: NDArray[np.bool_]) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
    """Chart 5 for what is gone, laid out right of the sheet, which lies as it is seen along z."""
    chart = np.where(gone, 5, -1).astype(np.int32)
    texels = (mesh.vertices[mesh.faces][..., :2] / STEP * 8 + 10).astype(np.float32)
    flat = plane_positions(mesh, chart, 8 / STEP)
    assert not flat[~gone].any()
    texels[gone] = flat[gone] - flat[gone].min(axis=(0, 1)) + [SIDE + 20, 20]
    return chart, texels


def painted_sheet(
    mesh: Mesh, texels: NDArray[np.float32], gone: NDArray[np.bool_]
) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """An atlas with a ramp of red along x on what is there."""
    atlas = np.zeros((SIDE, 2 * SIDE, 3), dtype=np.uint8)
    painted = np.zeros(atlas.shape[:2], dtype=np.uint8)
    ramp = np.zeros_like(atlas)
    ramp[..., 0], ramp[..., 1] = np.minimum(np.arange(2 * SIDE) * 2, 255), 90
    node, plain = np.zeros((len(mesh.faces), 3), np.int32), np.zeros((1, 3), np.float32)
    white = np.ones(3, dtype=np.float32)
    there = np.flatnonzero(~gone)
    paint_photo(ramp, white, there, texels, texels, node, plain, atlas, painted)
    return atlas, painted


def test_colours_are_continued_from_the_rim_and_the_rest_stays() -> None:
    mesh = sheet()
    middle = mesh.centroids[:, :2] - 0.5 * CELLS * STEP
    gone = np.asarray((np.abs(middle) < 3 * STEP).all(axis=1))
    chart, texels = charted(mesh, gone)
    atlas, painted = painted_sheet(mesh, texels, gone)
    before, was = atlas.copy(), painted.copy()
    continue_colours(mesh, chart, texels, atlas, painted)
    assert np.array_equal(atlas[was > 0], before[was > 0])
    centre = np.floor(texels[gone].mean(axis=1)).astype(int)
    colour = atlas[centre[:, 1], centre[:, 0]].astype(float)
    assert painted[centre[:, 1], centre[:, 0]].all()
    # The ramp goes on: red as it would be there, whatever way the chart is turned.
    should = 2 * (mesh.centroids[gone][:, 0] / STEP * 8 + 10)
    assert np.abs(colour[:, 0] - should).mean() < 12
    assert np.corrcoef(colour[:, 0], should)[0, 1] > 0.95
    assert np.abs(colour[:, 1] - 90).max() <= 6


def test_a_piece_all_of_whose_surroundings_lie_behind_it_gets_their_mean() -> None:
    # A strip folded under: seen along the chart's normal, all around lies within it.
    mesh = sheet()
    under = mesh.centroids[:, 0] > 0.5 * CELLS * STEP
    folded = mesh.vertices.copy()
    right = folded[:, 0] > 0.5 * CELLS * STEP
    folded[right] = np.column_stack(
        [CELLS * STEP - folded[right, 0], folded[right, 1], folded[right, 2] - 0.05]
    )
    mesh = Mesh(folded, mesh.faces)
    chart, texels = charted(mesh, ~under)
    atlas, painted = painted_sheet(mesh, texels, ~under)
    continue_colours(mesh, chart, texels, atlas, painted)
    centre = np.floor(texels[~under].mean(axis=1)).astype(int)
    assert np.abs(atlas[centre[:, 1], centre[:, 0], 1].astype(float) - 90).max() <= 2
