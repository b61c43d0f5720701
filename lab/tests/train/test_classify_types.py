"""Types of holds by relief."""

from __future__ import annotations

from dataclasses import replace
from importlib import resources

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from walltopo.core import Mesh
from walltopo.describe.classify.attributes import with_types
from walltopo.describe.classify.geometry import measure_shapes
from walltopo.describe.classify.types import (
    NONE_OF_THESE,
    SIDE,
    Relief,
    frame_relief,
    reliefs,
    shipped_model,
)
from walltopo.scans.holds import UNKNOWN, Hold
from walltopo_lab.synth.holds import make_hold

TYPES = ("jug", "crimp", "sloper", "pinch", "pocket", "foothold")
Floats = NDArray[np.float64]


def walled(
    points: Floats, faces: NDArray[np.int32], reach: float, closed: bool = False
) -> tuple[Mesh, NDArray[np.int32]]:
    """A body (right, up, out) on an upright wall that looks to -y, and the labels of the faces."""
    n = 41
    u, v = np.meshgrid(np.linspace(-reach, reach, n), np.linspace(-reach, reach, n))
    a = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    wall_faces = np.vstack(
        [np.column_stack([a, a + 1, a + n + 1]), np.column_stack([a, a + n + 1, a + n])]
    )
    wall = np.column_stack([u.ravel(), np.zeros(n * n), v.ravel()])
    body = np.column_stack([points[:, 0], -points[:, 2], points[:, 1]])
    if not closed:  # no photo sees the back
        faces = faces[points[faces][:, :, 2].mean(axis=1) > 1e-3]
    both = np.vstack([wall_faces, faces + n * n]).astype(np.int32)
    labels = np.r_[np.zeros(len(wall_faces)), np.ones(len(faces))].astype(np.int32)
    return Mesh(np.vstack([wall, body]), both), labels


def box(w: float, h: float, d: float) -> tuple[Floats, NDArray[np.int32]]:
    """A box on the wall."""
    import trimesh

    made = trimesh.creation.box((w, h, d)).subdivide_to_size(0.3 * min(w, h, d))
    points = np.asarray(made.vertices) + [0, 0, d / 2]
    return points, np.asarray(made.faces, dtype=np.int32)


def relief_of(mesh: Mesh, labels: NDArray[np.int32], unit: float = 1.0) -> Relief:
    return reliefs(mesh, labels, measure_shapes(mesh, labels, [1]), unit)[1]


def test_a_box_stands_as_high_as_it_is_and_covers_what_it_covers() -> None:
    relief = relief_of(*walled(*box(0.2, 0.1, 0.05), 0.4))
    heights, cover = relief.picture
    assert relief.side_m == pytest.approx(0.2 * 1.12, abs=0.02)
    middle = heights[SIDE // 2 - 3 : SIDE // 2 + 3, SIDE // 2 - 3 : SIDE // 2 + 3]
    np.testing.assert_allclose(middle * relief.side_m / 2, 0.05, atol=0.002)
    assert cover.sum() * (relief.side_m / SIDE) ** 2 == pytest.approx(0.02, rel=0.08)
    assert np.exp(relief.scalars[1]) * 0.05 == pytest.approx(0.05, rel=0.05)


def test_up_is_up() -> None:
    points, faces = box(0.1, 0.1, 0.05)
    points = points + np.where(points[:, 2:] > 0.04, 1, 0) * [0, 0.03, 0]
    points[:, 2] *= np.where(points[:, 1] > 0, 1.0, 0.4)
    heights, _ = relief_of(*walled(points, faces, 0.4)).picture
    assert heights[: SIDE // 2].max() > 1.5 * heights[SIDE * 2 // 3 :].max()


@settings(max_examples=15, deadline=None)
@given(
    turn=st.floats(-3.1, 3.1),
    shift=st.tuples(*[st.floats(-20, 20)] * 3),
    unit=st.floats(0.05, 40),
)
def test_a_relief_does_not_depend_on_place_heading_or_unit(
    turn: float, shift: tuple[float, float, float], unit: float
) -> None:
    body = make_hold("jug", "smooth", np.random.default_rng(3), 1.0, 0.6)
    mesh, labels = walled(body.vertices, body.faces, 0.5)
    c, s = np.cos(turn), np.sin(turn)
    rotation = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    moved = replace(mesh, vertices=(mesh.vertices @ rotation.T + shift) * unit)
    here, there = relief_of(mesh, labels), relief_of(moved, labels, unit)
    assert there.side_m == pytest.approx(here.side_m, rel=0.06)
    # Pixels at the rim may fall on either side of it, and so the frame a pixel further.
    assert np.abs(there.picture - here.picture).mean() < 0.05


@pytest.mark.parametrize("heading", [0.0, 1.3, 3.0])
def test_a_closed_body_beside_a_larger_panel_takes_the_normal_of_its_own(heading: float) -> None:
    body = make_hold("jug", "smooth", np.random.default_rng(3), 1.0, 0.6)
    mesh, labels = walled(body.vertices, body.faces, 0.14, closed=True)
    first = len(mesh.vertices)
    corners = np.array([[0.14, 0, -0.6], [0.14, -1.2, -0.6], [0.14, -1.2, 0.6], [0.14, 0, 0.6]])
    u, v = np.meshgrid(np.linspace(0, 1, 40), np.linspace(0, 1, 40))
    side = corners[0] + u.ravel()[:, None] * (corners[1] - corners[0])
    side = side + v.ravel()[:, None] * (corners[3] - corners[0])
    a = (np.arange(39)[:, None] * 40 + np.arange(39)).ravel()
    panel = np.vstack([np.column_stack([a, a + 41, a + 1]), np.column_stack([a, a + 40, a + 41])])
    vertices, faces = np.vstack([mesh.vertices, side]), np.vstack([mesh.faces, panel + first])
    c, s = np.cos(heading), np.sin(heading)
    rotation = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    both = Mesh(vertices @ rotation.T, faces.astype(np.int32))
    shape = measure_shapes(both, np.r_[labels, np.zeros(len(panel), np.int32)], [1])[1]
    np.testing.assert_allclose(shape.normal, rotation @ [0, -1, 0], atol=0.02)
    own = shape.position @ rotation @ [0, -1, 0]
    assert shape.standing_m == pytest.approx(own, abs=0.002)


def test_nothing_drawn_has_no_relief() -> None:
    assert frame_relief(np.zeros((9, 9)), np.zeros((9, 9), dtype=np.bool_), 0.01) is None


def test_a_stray_triangle_does_not_widen_the_frame() -> None:
    heights, mask = np.zeros((90, 90)), np.zeros((90, 90), dtype=np.bool_)
    mask[40:60, 35:65], heights[40:60, 35:65] = True, 0.03
    clean = frame_relief(heights, mask, 0.005)
    mask[2, 2] = True
    stray = frame_relief(heights, mask, 0.005)
    assert clean is not None
    assert stray is not None
    assert stray.side_m == pytest.approx(clean.side_m, rel=0.05)


def test_the_shipped_network_is_small_and_knows_the_six_types() -> None:
    model = shipped_model()
    assert set(model.names) == {*TYPES, NONE_OF_THESE}
    assert 0.3 < model.certain < 1
    file = resources.files("walltopo").joinpath("models/hold_types.onnx")
    assert len(file.read_bytes()) < 500_000


def test_generated_holds_are_named() -> None:
    rng = np.random.default_rng(77)
    looks, truth = [], []
    for kind in ("jug", "crimp", "sloper", "pinch", "pocket", "foot"):
        for style in ("organic", "smooth", "faceted", "ribbed"):
            body = make_hold(kind, style, rng, 1.0, 0.8)
            looks.append(relief_of(*walled(body.vertices, body.faces, 3 * body.radius)))
            truth.append("foothold" if kind == "foot" else kind)
    found = shipped_model().names_of(looks)
    named = [name for name, _ in found if name != UNKNOWN]
    right = [name == true for (name, _), true in zip(found, truth, strict=True)]
    assert sum(right) >= 0.7 * len(truth)
    assert sum(right) >= 0.85 * len(named)


def test_answers_do_not_depend_on_the_company() -> None:
    rng = np.random.default_rng(5)
    looks = []
    for kind in ("jug", "crimp", "pinch"):
        body = make_hold(kind, "smooth", rng, 1.0, 0.6)
        looks.append(relief_of(*walled(body.vertices, body.faces, 0.5)))
    model = shipped_model()
    together = model.probabilities(looks * 60)
    alone = np.vstack([model.probabilities([look]) for look in looks])
    np.testing.assert_allclose(together, np.tile(alone, (60, 1)), atol=1e-4)
    assert model.probabilities([]).shape == (0, len(model.names))


@pytest.mark.parametrize("size", [0.006, 4.0])
def test_sizes_unheard_of_are_unknown(size: float) -> None:
    body = make_hold("jug", "smooth", np.random.default_rng(3), 1.0, 0.6)
    points = body.vertices * size / (2 * body.radius)
    look = relief_of(*walled(points, body.faces, 3 * size))
    assert shipped_model().names_of([look])[0][0] == UNKNOWN


def test_a_patch_of_wall_and_noise_are_unknown() -> None:
    rng = np.random.default_rng(1)
    there = np.ones((SIDE, SIDE))
    flat = np.stack([0 * there, there]).astype(np.float32)
    noise = np.stack([rng.uniform(-1, 1, there.shape), there]).astype(np.float32)
    found = shipped_model().names_of([Relief(flat, 0.25), Relief(noise, 0.25)])
    assert [name for name, _ in found] == [UNKNOWN, UNKNOWN]


def test_volumes_keep_their_type_and_holds_without_a_relief_stay_unknown() -> None:
    place, out = (0.0, 0.0, 1.0), (0.0, -1.0, 0.0)
    holds = [
        Hold(1, "volume", "volume", type_confidence=1.0, position=place, normal=out),
        Hold(2, "hold", position=place, normal=out),
        Hold(3, "hold", position=place, normal=out),
    ]
    body = make_hold("jug", "smooth", np.random.default_rng(3), 1.0, 0.6)
    look = relief_of(*walled(body.vertices, body.faces, 0.5))
    typed = with_types(holds, {1: look, 2: look})
    assert [hold.type for hold in typed] == ["volume", "jug", UNKNOWN]
    assert typed[1].type_confidence > 0.5
    assert typed[2].type_confidence == 0.0
