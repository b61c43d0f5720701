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


def scattered(count: int, side: float, cell: float) -> Mesh:
    """Square sheets, turned about the vertical and four sides apart."""
    rng = np.random.default_rng(1)
    size = round(side / cell) + 1
    vertices, faces = [], []
    for k in range(count):
        own = sheet(rng.normal(0, 0.001, (size, size)), cell)
        angle = rng.uniform(0, 2 * np.pi)
        cosine, sine = np.cos(angle), np.sin(angle)
        turn = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
        vertices.append(own.vertices @ turn.T + [4 * side * (k % 15), 4 * side * (k // 15), 0.0])
        faces.append(own.faces + k * size**2)
    return Mesh(np.concatenate(vertices), np.concatenate(faces).astype(np.int32))


def test_heights_in_a_hall_are_those_over_each_panel() -> None:
    mesh = scattered(8, 1.0, 0.04)
    panels = find_panels(mesh, np.arange(len(mesh.faces)))
    assert len(panels) == 8
    found = heights_over(mesh, panels)
    literal = np.full((len(panels), len(mesh.faces)), np.nan)
    for number, panel in enumerate(panels):
        row, column, inside = panel.cells(mesh.centroids)
        away = panel.over_plane(mesh.centroids)
        near = inside & (away > -0.03) & (away < 0.6)
        literal[number, near] = (away - panel.surface[row, column])[near]
    assert np.isfinite(literal).sum(axis=0).max() == 1, "the panels are far apart"
    np.testing.assert_array_equal(found.height, np.nanmax(literal, axis=0, initial=-np.inf))
    assert (found.panel == np.isfinite(literal).argmax(axis=0)).all()


def test_a_stray_triangle_far_away_costs_nothing() -> None:
    whole = sheet(folded())
    stray = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]) + 4e7
    end = len(whole.vertices)
    mesh = Mesh(
        np.concatenate([whole.vertices, stray]),
        np.concatenate([whole.faces, [[end, end + 1, end + 2]]]).astype(np.int32),
    )
    panels = find_panels(mesh, np.arange(len(whole.faces)))
    alone, beside = heights_over(whole, panels), heights_over(mesh, panels)
    np.testing.assert_array_equal(beside.panel[:-1], alone.panel)
    assert beside.panel[-1] == NO_PANEL


@pytest.mark.slow
def test_a_large_hall_has_all_its_panels(monkeypatch: pytest.MonkeyPatch) -> None:
    """A hall of twenty walls has more than 200 panels."""
    monkeypatch.setattr("walltopo.geometry.panels.ITERATIONS", 8)  # any start finds a sheet
    mesh = scattered(230, 0.6, 0.05)
    assert len(find_panels(mesh, np.arange(len(mesh.faces)))) == 230
