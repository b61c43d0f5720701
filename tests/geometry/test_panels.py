"""Panels of a made-up wall, and what stands out of them."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from walltopo.core import Mesh
from walltopo.geometry.panels import NO_PANEL, find_panels, heights_over

Floats = NDArray[np.float64]


def sheet(height: Floats, cell: float = 0.02) -> Mesh:
    """A height field over x and z, seen from -y; `height` (rows, columns), towards the viewer."""
    rows, columns = height.shape
    z, x = np.mgrid[:rows, :columns] * cell
    vertices = np.column_stack([x.ravel(), -height.ravel(), z.ravel()])
    at = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = (part.ravel() for part in (at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]))
    faces = np.vstack([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    return Mesh(vertices, faces.astype(np.int32))


def folded(noise: float = 0.001, cell: float = 0.02) -> Floats:
    """Two panels of 2 m x 1.2 m that meet at an edge, with a hold of 5 cm on the left one."""
    z, x = np.mgrid[: round(2 / cell) + 1, : round(2.4 / cell) + 1] * cell
    height = np.where(x > 1.2, (x - 1.2) * 0.7, 0.0)
    height[(np.hypot(x - 0.6, z - 1.0) < 0.07)] += 0.05
    return np.asarray(height + np.random.default_rng(0).normal(0, noise, height.shape))


@pytest.mark.parametrize("unit", [1.0, 0.01])
def test_a_fold_makes_two_panels_and_a_hold_stands_out(unit: float) -> None:
    whole = sheet(folded())
    mesh = Mesh(whole.vertices * unit, whole.faces)
    panels = find_panels(mesh, np.arange(len(mesh.faces)), unit)
    assert len(panels) == 2
    assert sorted(round(float(p.area) / unit**2, 1) for p in panels) == [2.4, 2.9]
    heights = heights_over(mesh, panels, unit)
    places = mesh.centroids / unit
    on_hold = np.hypot(places[:, 0] - 0.6, places[:, 2] - 1.0) < 0.05
    off_hold = np.hypot(places[:, 0] - 0.6, places[:, 2] - 1.0) > 0.10
    assert np.median(heights.height[on_hold]) / unit == pytest.approx(0.05, abs=0.003)
    inner = off_hold & (np.abs(places[:, 0] - 1.2) > 0.05)
    assert (heights.panel[inner] != NO_PANEL).mean() > 0.99
    assert np.nanpercentile(np.abs(heights.height[inner]), 99) / unit < 0.005
    normals = sorted(panel.normal[0].round(2) for panel in panels)
    assert normals == pytest.approx([-0.57, 0.0], abs=0.02)


def test_a_bent_panel_is_its_own_level() -> None:
    _z, x = np.mgrid[:101, :101] * 0.02
    mesh = sheet(0.02 * np.cos(x * np.pi / 2.0))
    panels = find_panels(mesh, np.arange(len(mesh.faces)))
    heights = heights_over(mesh, panels)
    assert np.nanpercentile(np.abs(heights.height), 95) < 0.004


def test_facets_of_a_volume_are_no_panels() -> None:
    z, x = np.mgrid[:101, :101] * 0.02
    away = np.maximum(np.abs(x - 1.0), np.abs(z - 1.0))
    mesh = sheet(np.clip(0.9 * (0.35 - away), 0.0, 0.15))
    (panel,) = find_panels(mesh, np.arange(len(mesh.faces)))
    heights = heights_over(mesh, [panel])
    top = np.abs(mesh.centroids[:, [0, 2]] - 1.0).max(axis=1) < 0.15
    assert np.median(heights.height[top]) == pytest.approx(0.15, abs=0.01)


def test_no_triangles_no_panels() -> None:
    mesh = sheet(np.zeros((3, 3)))
    assert find_panels(mesh, np.zeros(0, dtype=np.int64)) == []
    assert (heights_over(mesh, []).panel == NO_PANEL).all()
