"""Borders: sharp on a mesh that is coarse."""

from __future__ import annotations

import numpy as np
import pytest

from walltopo.core import Camera, InputError, Instances, Mask, Mesh, View
from walltopo.segment.lift import LiftParams, lift
from walltopo.segment.lift.refine import refine_borders, split_faces

WIDTH, HEIGHT, FOCAL = 320, 240, 260.0
RADIUS = 0.45


def plane(cells: int) -> Mesh:
    """A square of side 2 in z = 0, with a colour at each vertex."""
    side = np.linspace(-1, 1, cells + 1)
    x, y = np.meshgrid(side, side)
    grid = np.arange(x.size, dtype=np.int32).reshape(x.shape)
    a, b = grid[:-1, :-1].ravel(), grid[:-1, 1:].ravel()
    c, d = grid[1:, 1:].ravel(), grid[1:, :-1].ravel()
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    colours = np.stack([x * 100 + 128, y * 100 + 128, 0 * x], -1).reshape(-1, 3)
    return Mesh(np.stack([x, y, 0 * x], -1).reshape(-1, 3), faces, colours.astype(np.uint8))


def disc_views(count: int) -> list[View]:
    """Cameras before the square; each shows a disc in its middle."""
    rng = np.random.default_rng(3)
    camera = Camera("PINHOLE", WIDTH, HEIGHT, (FOCAL, FOCAL, WIDTH / 2, HEIGHT / 2))
    rows, cols = np.mgrid[:HEIGHT, :WIDTH] + 0.5
    found = []
    for number in range(count):
        centre = np.array([*rng.uniform(-0.3, 0.3, 2), -2.2])
        view = View(f"{number}.jpg", camera, np.column_stack([np.eye(3), -centre]))
        x = (cols - WIDTH / 2) * 2.2 / FOCAL + centre[0]
        y = (rows - HEIGHT / 2) * 2.2 / FOCAL + centre[1]
        mask = Mask.from_full(np.hypot(x, y) < RADIUS, 1, 0.9)
        found.append(view.with_masks((mask,)))
    return found


def disc_iou(mesh: Mesh, instances: Instances) -> float:
    """IoU of the labelled faces with the true disc, by samples of every face."""
    weights = np.array([(i, j, 12 - i - j) for i in range(13) for j in range(13 - i)]) / 12
    points = np.einsum("sk,fkd->fsd", weights, mesh.vertices[mesh.faces])
    inside = (np.hypot(points[..., 0], points[..., 1]) < RADIUS).mean(axis=1) * mesh.areas
    own = instances.face_instance > 0
    return float(inside[own].sum() / (mesh.areas[own].sum() + inside[~own].sum()))


def edge_counts(mesh: Mesh) -> dict[tuple[int, int], int]:
    counts: dict[tuple[int, int], int] = {}
    for face in mesh.faces.tolist():
        for k in range(3):
            key = (min(face[k], face[(k + 1) % 3]), max(face[k], face[(k + 1) % 3]))
            counts[key] = counts.get(key, 0) + 1
    return counts


def check_whole(mesh: Mesh) -> None:
    """A square without cracks: only its rim belongs to one face, and no vertex is on an edge."""
    counts = edge_counts(mesh)
    assert max(counts.values()) == 2
    rim = np.array([edge for edge, count in counts.items() if count == 1])
    ends = mesh.vertices[rim]
    # Both ends on the same side of the square: a T-junction would leave open edges inside it.
    assert ((np.abs(ends) > 1 - 1e-12).all(axis=1)).any(axis=1).all()
    assert np.linalg.norm(np.diff(ends, axis=1), axis=-1).sum() == pytest.approx(8.0)
    assert mesh.areas.sum() == pytest.approx(4.0)
    assert (mesh.normals[:, 2] > 0.999).all()


def test_a_coarse_mesh_gets_a_sharp_disc() -> None:
    mesh, views = plane(12), disc_views(6)
    coarse = lift(mesh, views)
    before = disc_iou(mesh, coarse)
    ious = []
    for levels in (1, 2, 3):
        finer, labels = refine_borders(mesh, views, coarse, levels=levels)
        check_whole(finer)
        assert labels.records == coarse.records
        ious.append(disc_iou(finer, labels))
    assert before < 0.9
    assert ious[0] > before + 0.03
    assert ious[2] > 0.97
    assert ious == sorted(ious)


def test_pieces_lie_in_their_parents_and_carry_their_colours() -> None:
    mesh = plane(6)
    chosen = np.random.default_rng(0).random(len(mesh.faces)) < 0.3
    finer, parent = split_faces(mesh, chosen)
    check_whole(finer)
    areas = np.bincount(parent, finer.areas, minlength=len(mesh.faces))
    np.testing.assert_allclose(areas, mesh.areas)
    assert (np.bincount(parent)[chosen] == 4).all()
    assert finer.vertex_colours is not None
    expected = finer.vertices[:, :2] * 100 + 128
    assert np.abs(finer.vertex_colours[:, :2] - expected).max() <= 1.5


def test_nothing_to_refine_changes_nothing() -> None:
    mesh, views = plane(8), disc_views(3)
    found = lift(mesh, views)
    assert refine_borders(mesh, views, found, levels=0) == (mesh, found)
    bare = lift(mesh, [view.with_masks(()) for view in views])
    assert refine_borders(mesh, views, bare)[0] is mesh
    same, parent = split_faces(mesh, np.zeros(len(mesh.faces), dtype=np.bool_))
    np.testing.assert_array_equal(same.faces, mesh.faces)
    np.testing.assert_array_equal(parent, np.arange(len(mesh.faces)))


def test_an_instance_is_never_refined_away() -> None:
    mesh, views = plane(8), disc_views(4)
    found = lift(mesh, views)
    strict = LiftParams(threshold=1.0)  # no piece has all the evidence
    _, labels = refine_borders(mesh, views, found, strict, levels=1)
    assert (labels.face_instance == 1).any()


def test_what_does_not_fit_the_mesh_is_refused() -> None:
    mesh, views = plane(8), disc_views(3)
    found = lift(mesh, views)
    with pytest.raises(InputError, match="triangles"):
        refine_borders(plane(4), views, found)
    with pytest.raises(InputError, match="levels"):
        refine_borders(mesh, views, found, levels=-1)
