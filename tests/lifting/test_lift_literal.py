"""The fast literal method against the reference: same clusters, same faces."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import networkx
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from walltopo.core import Instances, Mesh, View
from walltopo.graphs.components import renumber
from walltopo.lifting.contract import LiftParams
from walltopo.lifting.easing import ease
from walltopo.lifting.fast import lift_literal
from walltopo.lifting.literal import lift_reference

Ints = NDArray[np.integer]
Floats = NDArray[np.float64]


def louvain_networkx(
    count: int, first: Ints, second: Ints, weight: Floats, resolution: float, seed: int
) -> NDArray[np.int32]:
    """`louvain.Partition` by networkx, which shares nothing with the one that the lift uses."""
    graph = networkx.Graph()
    graph.add_nodes_from(range(count))
    graph.add_weighted_edges_from(
        zip(first.tolist(), second.tolist(), weight.tolist(), strict=True)
    )
    groups = networkx.community.louvain_communities(graph, resolution=resolution, seed=seed)
    clusters = np.zeros(count, dtype=np.int64)
    for number, group in enumerate(groups):
        clusters[list(group)] = number
    return renumber(clusters)


def assert_equal(fast: Instances, slow: Instances) -> None:
    """Faces, scores, classes and the masks of every instance."""
    np.testing.assert_array_equal(fast.face_instance, slow.face_instance)
    np.testing.assert_allclose(fast.face_score, slow.face_score, atol=1e-5)
    assert [r.label for r in fast.records] == [r.label for r in slow.records]
    assert [r.views for r in fast.records] == [r.views for r in slow.records]
    np.testing.assert_allclose(
        [r.score for r in fast.records], [r.score for r in slow.records], atol=1e-5
    )


@given(
    seed=st.integers(0, 100_000),
    power=st.floats(-1, 1),
    threshold=st.floats(0.05, 0.95),
    resolution=st.sampled_from([0.5, 1.0, 5.0]),
    distorted=st.booleans(),
    pixels=st.sampled_from([0, 40, 200]),
)
@example(seed=1, power=0.0, threshold=0.5, resolution=0.5, distorted=True, pixels=0)  # unseen mask
@settings(max_examples=25, deadline=None)
def test_same_as_the_reference_on_random_scenes(
    make_scene: Any, seed: int, power: float, threshold: float, resolution: float,
    distorted: bool, pixels: int,
) -> None:  # fmt: skip
    # Both get networkx's Louvain: the graphs are the same, but two implementations may settle
    # on different partitions of equal worth.
    mesh, views = make_scene(seed, distorted=distorted)
    params = LiftParams(
        method="literal", visibility_distance=3.0, easing_power=power, threshold=threshold,
        resolution=resolution, mask_resolution=pixels,
    )  # fmt: skip
    slow = lift_reference(mesh, views, params, louvain_networkx)
    assert_equal(lift_literal(mesh, views, params, partition=louvain_networkx), slow)


@pytest.mark.data
def test_same_as_the_reference_on_a_decimated_gym(gym_a: Path) -> None:
    import fast_simplification

    from walltopo.scans.detections import read_coco_masks
    from walltopo.scans.model import read_views

    truth = np.load(gym_a / "lift" / "gt.npz")
    vertices, faces = fast_simplification.simplify(
        truth["vertices"].astype(np.float32), truth["faces"], target_count=30_000
    )
    mesh = Mesh(vertices.astype(np.float64), faces.astype(np.int32))
    masks, _ = read_coco_masks(gym_a / "lift" / "noisy.json")
    views = [v.with_masks(masks[v.name]) for v in read_views(gym_a / "lift" / "cameras")[::10]]
    params = LiftParams(method="literal", resolution=3.0)
    slow = lift_reference(mesh, views, params, louvain_networkx)
    fast = lift_literal(mesh, views, params, partition=louvain_networkx)
    # The reference's rays are float32: a centroid within rounding of a silhouette may differ.
    assert (fast.face_instance != slow.face_instance).sum() <= 2
    # And with its own Louvain the fast one finds the same objects.
    own = lift_literal(mesh, views, params)
    assert abs(len(own) - len(slow)) <= 3


def test_a_triangle_behind_another_is_not_seen(three_bumps: Any) -> None:
    mesh, views, _ = three_bumps
    # A screen right before the cameras' targets, as part of the same mesh.
    screen = np.array([[-3, -3, -0.8], [3, -3, -0.8], [0, 5, -0.8]])
    vertices = np.concatenate([mesh.vertices, screen])
    faces = np.concatenate([mesh.faces, len(mesh.vertices) + np.array([[0, 1, 2]])])
    hidden = Mesh(vertices, faces.astype(np.int32))
    found = lift_literal(hidden, views, LiftParams(method="literal"))
    assert (found.face_instance[:-1] == 0).all()


@pytest.mark.parametrize(("power", "expected"), [(0.0, 0.5), (-1.0, 0.5**0.25), (1.0, 0.5**4)])
def test_easing(power: float, expected: float) -> None:
    got = ease(np.array([0.0, 4.0, 8.0, 9.0]), 8.0, power)
    np.testing.assert_allclose(got, [1.0, expected, 0.0, 0.0])


def test_the_three_objects_come_out(three_bumps: tuple[Mesh, list[View], np.ndarray]) -> None:
    mesh, views, truth = three_bumps
    found = lift_literal(mesh, views, LiftParams(method="literal"))
    assert len(found) == 3
    for record in found.records:
        mine = found.face_instance == record.id
        owner = np.bincount(truth[mine]).argmax()
        assert (mine & (truth == owner)).sum() / (mine | (truth == owner)).sum() > 0.85
