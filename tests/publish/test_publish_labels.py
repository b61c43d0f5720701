"""Labels beside the tiers: every triangle of the mesh gets its own label back."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from walltopo.core import Mesh
from walltopo.publish.labels import surface_labels
from walltopo.scans.page_labels import SurfaceLabels

SIDE = 12
Labels = NDArray[np.int32]


def sheet() -> Mesh:
    """A sheet of squares of 2 cm, each two triangles."""
    x, z = np.meshgrid(np.arange(SIDE + 1), np.arange(SIDE + 1))
    vertices = np.stack([x, 0 * x, z], axis=-1).reshape(-1, 3) * 0.02
    a = (np.arange(SIDE)[:, None] * (SIDE + 1) + np.arange(SIDE)).ravel()
    right, up = a + 1, a + SIDE + 1
    faces = np.vstack([np.stack([a, right, up + 1], 1), np.stack([a, up + 1, up], 1)])
    return Mesh(vertices.astype(float), faces.astype(np.int32))


MESH = sheet()
COUNT = len(MESH.faces)


def places(steps: tuple[int, ...], surface: SurfaceLabels) -> NDArray[np.float64]:
    grid = np.array(steps, dtype=float).reshape(-1, 3).cumsum(axis=0)
    return np.asarray(grid * surface.step + surface.origin)


def read(surface: SurfaceLabels, patches: Labels) -> Labels:
    """The labels as a viewer finds them: of the nearest place, else of the patch."""
    shown = dict(surface.patches)
    labels = np.array([shown.get(patch, patch) for patch in patches.tolist()], dtype=np.int32)
    for group in surface.changed:
        away = np.linalg.norm(MESH.centroids[:, None] - places(group.places, surface)[None], axis=2)
        own = away.min(axis=1) < surface.edge / 8
        labels[own] = group.label
    return labels


labellings = st.lists(st.integers(0, 4), min_size=COUNT, max_size=COUNT)


@given(labellings, labellings)
def test_labels_come_back(before: list[int], after: list[int]) -> None:
    patches, labels = np.array(before, dtype=np.int32), np.array(after, dtype=np.int32)
    assert (read(surface_labels(MESH, patches, labels), patches) == labels).all()


def test_a_hold_that_is_gone_or_joined_costs_a_number() -> None:
    patches = np.repeat(np.arange(4, dtype=np.int32), COUNT // 4)
    labels = np.array([0, 0, 2, 2], dtype=np.int32)[patches]
    surface = surface_labels(MESH, patches, labels)
    assert surface.patches == ((1, 0), (3, 2))
    assert surface.changed == ()
    assert surface.unchanged == ()


def test_around_what_changed_is_reported_what_did_not() -> None:
    patches = np.zeros(COUNT, dtype=np.int32)
    labels = patches.copy()
    labels[COUNT // 2 + SIDE * 6 + 6] = 9
    surface = surface_labels(MESH, patches, labels)
    assert [group.label for group in surface.changed] == [9]
    around = places(surface.unchanged, surface)
    (own,) = places(surface.changed[0].places, surface)
    assert len(around) == 12
    assert np.linalg.norm(around - own, axis=1).max() < 0.04
    assert surface.edge == pytest.approx(0.02)
