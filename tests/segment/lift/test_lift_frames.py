"""A mesh in another unit or with other axes than the cameras."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

from walltopo.core import Mesh
from walltopo.segment.lift_frames import MeshChange, explain_frames


def changed(mesh: Mesh, change: MeshChange) -> Mesh:
    """Return the mesh that the change brings back into the frame of the cameras."""
    return Mesh(mesh.vertices @ change.rotation / change.factor, mesh.faces)


def in_front(mesh: Mesh) -> Mesh:
    """Return the mesh of the scene, whose triangles are inside out, with its front outside."""
    return Mesh(mesh.vertices, np.ascontiguousarray(mesh.faces[:, ::-1]))


def test_a_mesh_in_the_frame_of_the_cameras_has_no_hint(three_bumps: Any) -> None:
    mesh, views = three_bumps[:2]
    assert explain_frames(in_front(mesh), views, 0) == ""
    assert "from behind" in explain_frames(mesh, views, 0)


@pytest.mark.parametrize("factor", [0.001, 1000.0, 0.0254, 100.0])
def test_the_factor_is_named(factor: float, three_bumps: Any) -> None:
    mesh, views = three_bumps[:2]
    change = MeshChange(factor)
    assert f"were {change.describe()}," in explain_frames(changed(mesh, change), views, 0)


@pytest.mark.parametrize("turn", [(0, 90), (0, -90), (1, 90)])
@pytest.mark.parametrize("factor", [1.0, 0.001])
def test_a_turn_that_fits_is_named(turn: tuple[int, int], factor: float, three_bumps: Any) -> None:
    """The scene is symmetric, so several turns may fit; the named one does."""
    mesh, views = three_bumps[:2]
    hint = explain_frames(changed(mesh, MeshChange(factor, *turn)), views, 0)
    assert re.search("if the mesh were turned by .*, (9[0-9]|100) % would", hint)
    assert ("scaled" in hint) == (factor != 1)
