"""Route parameters on labelled scans."""

from __future__ import annotations

import numpy as np
import pytest

from walltopo.core import Mesh
from walltopo.describe.routes.proxy import PROXY_FACES, build_proxy
from walltopo_lab.tune.routes_task import RoutesTask, RoutesWall
from walltopo_lab.tune.walls import scan_names


def flat_wall(name: str, routes: tuple[int, ...]) -> RoutesWall:
    """Four holds of one colour, two and two side by side, on a wall of 6 x 2 m."""
    x, z = (grid.ravel() for grid in np.meshgrid(np.arange(13) / 2, np.arange(5) / 2))
    vertices = np.column_stack([x, np.zeros(len(x)), z])
    first = (np.arange(4)[:, None] * 13 + np.arange(12)).ravel()
    quads = [(first, first + 1, first + 13), (first + 1, first + 14, first + 13)]
    mesh = Mesh(vertices, np.vstack([np.column_stack(q) for q in quads]).astype(np.int32))
    points = np.array([[1.1, 0, 0.6], [1.3, 0, 1.4], [5.1, 0, 0.6], [5.3, 0, 1.4]])
    proxy = build_proxy(mesh.vertices, mesh.faces, points, PROXY_FACES)
    return RoutesWall(name, points, ("red",) * 4, routes, proxy)


def test_two_scans_of_one_wall_are_two_figures() -> None:
    task = RoutesTask([flat_wall("a", (0, 0, 1, 1)), flat_wall("a", (0, 1, 0, 1))])
    figures = task.evaluate({})
    assert figures["a #1"] == pytest.approx(1.0)
    assert figures["a #2"] < 0.1


def test_names_stay_where_they_differ() -> None:
    assert scan_names(["a", "b", "a"]) == ["a #1", "b", "a #2"]
