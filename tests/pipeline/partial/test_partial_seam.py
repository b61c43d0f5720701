"""The lines along which a partial rescan meets the old wall."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from tests.pipeline.partial.partial_walls import STEP, Wall

from walltopo.core import Mesh
from walltopo.pipeline.partial.seam import TOLERANCE, seam_lines, simplified


def test_the_seam_is_where_replaced_surface_meets_the_rest() -> None:
    mesh, _ = Wall().mesh()
    (line,) = seam_lines(mesh, mesh.centroids[:, 0] > 1.5)
    # From the floor to the top of a wall of 2 m. The wall's own border is no seam.
    assert sorted([line[0, 2], line[-1, 2]]) == pytest.approx([0.0, 2.0])
    assert np.abs(line[:, 0] - 1.5).max() < STEP
    assert len(line) < 20


def test_a_region_inside_the_wall_has_a_closed_seam() -> None:
    mesh, _ = Wall().mesh()
    inside = (np.abs(mesh.centroids[:, [0, 2]] - [2.0, 1.0]) < [0.6, 0.4]).all(axis=1)
    (line,) = seam_lines(mesh, np.asarray(~inside))
    assert np.array_equal(line[0], line[-1])
    length = np.linalg.norm(np.diff(line, axis=0), axis=1).sum()
    assert length == pytest.approx(2 * (1.2 + 0.8), rel=0.05)


def test_each_part_of_a_seam_is_a_line() -> None:
    mesh, _ = Wall().mesh()
    middle = np.abs(mesh.centroids[:, 0] - 2.0) < 0.5
    corner = (mesh.centroids[:, [0, 2]] < 0.5).all(axis=1)
    single = (np.abs(mesh.centroids[:, [0, 2]] - [0.8, 1.5]) < STEP / 2).all(axis=1)
    assert single.any()
    lines = seam_lines(mesh, ~(middle | corner | single))
    # The seam around single triangles is too short to be drawn.
    assert len(lines) == 3
    assert sorted(round(float(line[:, 0].mean()), 1) for line in lines)[1:] == [1.5, 2.5]


def test_a_wall_of_separate_surfaces_has_a_seam_only_in_the_cut_one() -> None:
    """A wall that was rescanned before consists of surfaces that share no vertex."""
    first, second = Wall(x=(0.0, 2.0)).mesh()[0], Wall(x=(2.0, 4.0)).mesh()[0]
    faces = np.vstack([first.faces, second.faces + len(first.vertices)])
    mesh = Mesh(np.vstack([first.vertices, second.vertices]), faces)
    assert seam_lines(mesh, mesh.centroids[:, 0] > 2.0) == []
    assert len(seam_lines(mesh, mesh.centroids[:, 0] > 3.0)) == 1


def test_a_mesh_of_many_vertices_has_a_seam() -> None:
    """An edge has the number vertex times vertices, which exceeds 32 bits."""
    mesh, _ = Wall(x=(0.0, 10.0)).mesh()
    assert len(mesh.vertices) ** 2 > 2**31
    assert len(seam_lines(mesh, mesh.centroids[:, 0] > 9.5)) == 1


def test_nothing_replaced_has_no_seam() -> None:
    mesh, _ = Wall().mesh()
    assert seam_lines(mesh, np.ones(len(mesh.faces), dtype=np.bool_)) == []


def test_a_simpler_line_stays_near_all_its_points() -> None:
    angle = np.linspace(0, 2 * np.pi, 400)
    circle = np.column_stack([np.cos(angle), np.zeros(400), np.sin(angle)])
    circle[-1] = circle[0]
    line = simplified(circle, TOLERANCE)
    assert 10 < len(line) < 60
    samples = np.vstack([np.linspace(a, b, 50) for a, b in pairwise(line)])
    away = np.linalg.norm(circle[:, None] - samples[None], axis=2).min(axis=1)
    assert away.max() < 1.1 * TOLERANCE
