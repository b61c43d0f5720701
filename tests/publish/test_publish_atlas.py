"""The atlas of simplified tiers: colours that stay where they were."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from walltopo.core import Mesh
from walltopo.publish.atlas import retexture
from walltopo.publish.settings import ExportSettings
from walltopo.publish.surface import TexturedSurface, split_at_borders
from walltopo.publish.tiers import TierBuilder
from walltopo.publish.wall_data import read_wall
from walltopo.scans.folder import ScanFolder

MakeScan = Callable[..., ScanFolder]


def test_a_mat_does_not_hide_the_foot_of_an_overhang() -> None:
    """A red wall that leans over a blue mat: from below, the mat lies before the wall's foot."""
    up, along = np.array([0.0, -0.7, 1.0]), np.linspace(0.0, 1.0, 9)
    x, s = (grid.ravel() for grid in np.meshgrid(along, along))
    wall = np.column_stack([x, np.zeros(81), np.zeros(81)]) + s[:, None] * up
    mat = np.column_stack([x, 0.2 - 2 * s, np.zeros(81)])
    first = (np.arange(8)[:, None] * 9 + np.arange(8)).ravel()
    quad = np.vstack(
        [
            np.column_stack([first, first + 1, first + 9]),
            np.column_stack([first + 1, first + 10, first + 9]),
        ]
    )
    faces = np.vstack([quad, quad[:, ::-1] + 81]).astype(np.int32)
    vertices = np.vstack([wall, mat])
    uv = np.full((256, 3, 2), 0.25, np.float32)
    uv[128:, :, 0] = 0.75
    picture = np.zeros((8, 8, 3), np.uint8)
    picture[:, :4, 0], picture[:, 4:, 2] = 200, 200
    mesh, wall_alone = Mesh(vertices, faces), np.zeros(256, np.int32)
    detailed = TexturedSurface(split_at_borders(mesh, wall_alone, uv), picture)
    new = retexture(split_at_borders(mesh, wall_alone), detailed, 256)
    surface, atlas = new.surface, new.picture
    assert surface.uv is not None
    assert atlas is not None
    corner = surface.triangles.astype(int)
    at = (surface.uv[corner].mean(axis=1) * 256).astype(int)
    shown = atlas[at[:, 1], at[:, 0]]
    on_mat = np.ptp(surface.positions[corner][..., 2], axis=1) < 1e-6
    assert (shown[~on_mat, 0] > 180).all()
    assert (shown[on_mat, 2] > 180).all()


def test_colours_stay_on_the_surface(make_scan: MakeScan) -> None:
    """The new atlas shows at each place what the old one shows there."""
    wall = read_wall(make_scan(cells=120))
    builder = TierBuilder(wall, ExportSettings(first_triangles=1500, first_texture=512))
    first, full = builder.textured_surface("first"), builder.textured_surface("archive")
    assert first.surface.uv is not None
    assert first.picture is not None
    assert full.picture is not None
    corner = first.surface.triangles.astype(int)
    middle = first.surface.uv[corner].mean(axis=1)
    place = first.surface.positions[corner].mean(axis=1)
    height, width = first.picture.shape[:2]
    new = first.picture[(middle[:, 1] * height).astype(int), (middle[:, 0] * width).astype(int)]
    # The scan's own texture is the panel's front view: 6 x 4 metres.
    tall, wide = full.picture.shape[:2]
    low, high = np.full(new.shape, 255), np.zeros(new.shape, int)
    # Rims are drawn smooth, and simplification moves them a little: any colour between those
    # within three pixels, 35 mm, is right.
    for down in range(-3, 4):
        for along in range(-3, 4):
            row = np.clip(((4.0 - place[:, 2]) / 4.0 * tall).astype(int) + down, 0, tall - 1)
            column = np.clip((place[:, 0] / 6.0 * wide).astype(int) + along, 0, wide - 1)
            low = np.minimum(low, full.picture[row, column])
            high = np.maximum(high, full.picture[row, column])
    right = ((new >= low - 12) & (new <= high + 12)).all(axis=1)
    assert np.mean(right) > 0.99
