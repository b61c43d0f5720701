"""Mesh and texture of a partial rescan."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from tests.pipeline.partial.partial_walls import Wall, flat_uv, photos_at

from walltopo.pipeline.partial.region import replaced_region, seam_offsets
from walltopo.pipeline.partial.rows import Tables, join_tables, renumbered
from walltopo.pipeline.partial.surface import Part, join_meshes, join_textures
from walltopo.scans.holds import Holds
from walltopo.scans.routes import Routes


def _picture(seed: int, side: int = 256) -> NDArray[np.uint8]:
    rng = np.random.default_rng(seed)
    small = rng.integers(0, 255, (16, 16, 3), dtype=np.uint8)
    return np.kron(small, np.ones((side // 16, side // 16, 1), dtype=np.uint8))


def _colours(image: NDArray[np.uint8], uv: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Return the colour at the middle of each triangle."""
    height, width = image.shape[:2]
    x, y = (uv.mean(axis=1) * [width, height]).astype(int).T
    return image[np.clip(y, 0, height - 1), np.clip(x, 0, width - 1)]


def test_joined_triangles_keep_their_place_and_their_pixels() -> None:
    first, second = Wall().mesh()[0], Wall(x=(0.0, 2.0)).mesh()[0]
    left = first.centroids[:, 0] < 2
    parts = (
        Part(first, ~left, flat_uv(first), _picture(1)),
        Part(second, np.ones(len(second.faces), np.bool_), flat_uv(second), _picture(2)),
    )
    mesh = join_meshes(parts)
    image, uv = join_textures(parts)
    corners = np.vstack([part.mesh.vertices[part.mesh.faces[part.chosen]] for part in parts])
    assert np.array_equal(mesh.vertices[mesh.faces], corners)
    before = np.vstack([_colours(part.image, part.uv[part.chosen]) for part in parts])
    assert (_colours(image, uv) == before).all(axis=1).mean() > 0.999
    assert uv.min() >= 0
    assert uv.max() <= 1
    # Two halves of 4 x 2 m at 64 pixels a metre.
    assert image.shape[0] <= 512


def test_charts_of_replaced_triangles_leave_the_picture() -> None:
    mesh = Wall().mesh()[0]
    uv, picture = flat_uv(mesh), _picture(3, 1024)
    few = np.abs(mesh.centroids[:, 0] - 1) < 0.1
    parts = (Part(mesh, few, uv, picture), Part(mesh, few, uv, picture))
    assert join_textures(parts)[0].shape[0] <= 768


@pytest.mark.slow
def test_twenty_partial_rescans_do_not_drift() -> None:
    """Untouched holds stay exactly where they were, and the seams within 5 mm."""
    rng = np.random.default_rng(0)
    places = {k + 1: (0.2 + 0.3 * (k % 13), 0.3 + 0.35 * (k // 13), 0.05) for k in range(13 * 5)}
    wall = Wall(holds=places)
    mesh, labels = wall.mesh(0.001)
    holds = {hold.id: hold for hold in wall.rows()}
    uv, picture = flat_uv(mesh), _picture(0)
    size = len(mesh.faces)
    for turn in range(20):
        x, z = rng.uniform(0.5, 3.5), rng.uniform(0.6, 1.4)
        inside = {n for n, hold in holds.items() if abs(hold.position[0] - x) < 1.2}
        kept = {n: holds[n] for n in inside if rng.random() < 0.7}
        spots = {
            number: (hold.position[0], hold.position[2], hold.size / 2)
            for number, hold in enumerate(kept.values(), start=1)
        }
        part = Wall(x=(max(0, x - 1.2), min(4, x + 1.2)), holds=spots)
        new_mesh, new_labels = part.mesh(0.001, seed=turn + 1)
        views = photos_at((x - 0.1, z), (x + 0.1, z), away=0.9)
        region = replaced_region(mesh, labels, new_mesh, new_labels, views)
        offsets = seam_offsets(mesh, labels, new_mesh, region)
        assert np.percentile(offsets, 95) < 0.005
        old = Tables(
            frozenset(labels[region.old].tolist()) - {0},
            Holds(metric=True, holds=tuple(holds.values())),
            Routes(routes=()),
            (),
            max(holds),
        )
        new = Tables(
            frozenset(region.new_labels[region.new].tolist()) - {0},
            Holds(metric=True, holds=tuple(part.rows())),
            Routes(routes=()),
            (),
            len(spots),
        )
        joined = join_tables(old, new, {"a.jpg": "a.jpg"}, {"a.jpg"})
        untouched = old.present & holds.keys()
        after = {hold.id: hold for hold in joined.holds.holds}
        assert all(after[number] == holds[number] for number in untouched)
        parts = (
            Part(mesh, region.old, uv, picture),
            Part(new_mesh, region.new, flat_uv(new_mesh), _picture(turn)),
        )
        first = mesh.vertices[mesh.faces[region.old]]
        mesh = join_meshes(parts)
        assert np.array_equal(mesh.vertices[mesh.faces[: len(first)]], first)
        picture, uv = join_textures(parts)
        fresh = renumbered(region.new_labels, joined.number_of)
        labels = np.concatenate([labels[region.old], fresh[region.new]])
        holds = after
    # Neither the mesh nor its picture grows with the number of rescans.
    assert len(mesh.faces) < 1.3 * size
    assert picture.shape[0] <= 1024
