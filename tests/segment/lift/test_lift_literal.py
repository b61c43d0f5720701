"""The fast literal method against the reference: same clusters, same faces."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import networkx
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from walltopo.core import Camera, Instances, Mask, Mesh, View
from walltopo.geometry.graphs import renumber
from walltopo.segment.lift.distance import distance_weight
from walltopo.segment.lift.fast import best_cluster, lift_literal, literal_kept, projection_scores
from walltopo.segment.lift.literal import lift_reference, reference_kept
from walltopo.segment.lift.settings import Confidence, LiftParams, OnTop

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
    on_top=st.sampled_from(["small", "surest"]),
    confidence=st.sampled_from(["mean", "sum", "share"]),
)
@example(1, 0.0, 0.5, 0.5, True, 0, "surest", "mean")  # an unseen mask
@settings(max_examples=25, deadline=None)
@pytest.mark.usefixtures("exact_rays")
def test_same_as_the_reference_on_random_scenes(
    make_scene: Any,
    seed: int,
    power: float,
    threshold: float,
    resolution: float,
    distorted: bool,
    pixels: int,
    on_top: OnTop,
    confidence: Confidence,
) -> None:
    # Both get networkx's Louvain: the graphs are the same, but two implementations may settle
    # on different partitions of equal worth.
    mesh, views = make_scene(seed, distorted=distorted)
    params = LiftParams(
        method="literal",
        visibility_distance=3.0,
        easing_power=power,
        threshold=threshold,
        resolution=resolution,
        mask_resolution=pixels,
        on_top=on_top,
        confidence=confidence,
    )
    slow = lift_reference(mesh, views, params, louvain_networkx)
    assert_equal(lift_literal(mesh, views, params, partition=louvain_networkx), slow)
    # The publication's own result, in which instances of two classes may share a triangle.
    evidence, _, kept = literal_kept(mesh, views, params, partition=louvain_networkx)
    number, shares = np.unique(kept.cluster, return_inverse=True)[1], kept.share
    fast = [
        dict(zip(evidence.faces[kept.face[number == k]].tolist(), shares[number == k], strict=True))
        for k in range(int(number.max(initial=-1)) + 1)
    ]
    expected = [
        faces for faces in reference_kept(mesh, views, params, louvain_networkx)[2] if faces
    ]
    assert [faces.keys() for faces in fast] == [faces.keys() for faces in expected]
    for mine, theirs in zip(fast, expected, strict=True):
        assert mine == pytest.approx(theirs, abs=1e-5)


@pytest.mark.data
def test_same_as_the_reference_on_a_decimated_gym(gym_a: Path) -> None:
    import fast_simplification

    from walltopo.scans.coco_import import read_coco_masks
    from walltopo.scans.colmap_model import read_views

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
    got = distance_weight(np.array([0.0, 4.0, 8.0, 9.0]), 8.0, power)
    np.testing.assert_allclose(got, [1.0, expected, 0.0, 0.0])


def test_the_three_objects_come_out(three_bumps: tuple[Mesh, list[View], np.ndarray]) -> None:
    mesh, views, truth = three_bumps
    found = lift_literal(mesh, views, LiftParams(method="literal"))
    assert len(found) == 3
    for record in found.records:
        mine = found.face_instance == record.id
        owner = np.bincount(truth[mine]).argmax()
        assert (mine & (truth == owner)).sum() / (mine | (truth == owner)).sum() > 0.85


def two_boxes(outer: float, inner: float, label: int = 1) -> View:
    """A view of the plane z = 1 with a mask of its middle, and a smaller one inside that."""
    camera = Camera("PINHOLE", 40, 40, (40.0, 40.0, 20.0, 20.0))

    def box(side: int, score: float, label: int) -> Mask:
        bitmap = np.zeros((40, 40), dtype=np.bool_)
        bitmap[20 - side : 20 + side, 20 - side : 20 + side] = True
        return Mask.from_full(bitmap, label, score)

    return View("a.jpg", camera, np.eye(3, 4), (box(12, outer, 1), box(4, inner, label)))


def plane() -> Mesh:
    """Unit square at z = 1 before the camera, in 800 triangles."""
    side = np.linspace(-0.5, 0.5, 21)
    x, y = np.meshgrid(side, side)
    grid = np.arange(x.size).reshape(x.shape)
    a, b = grid[:-1, :-1].ravel(), grid[:-1, 1:].ravel()
    c, d = grid[1:, 1:].ravel(), grid[1:, :-1].ravel()
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    return Mesh(np.stack([x, y, np.ones_like(x)], -1).reshape(-1, 3), faces.astype(np.int32))


@pytest.mark.parametrize(("on_top", "expected"), [("small", 2), ("surest", 1)])
def test_the_order_of_drawing_decides_what_a_covered_mask_is(on_top: OnTop, expected: int) -> None:
    # The smaller mask is the less sure one: under the larger it shows no pixel.
    found = lift_literal(plane(), [two_boxes(0.9, 0.5)], LiftParams("literal", on_top=on_top))
    assert len(found) == expected


def test_the_positive_score_is_the_mean_of_a_projection() -> None:
    """Algorithm 5 adds `p.score`, the same for all triangles of a mask, near and far ones."""
    near, far = replace(two_boxes(0.9, 0.9), name="a"), two_boxes(0.9, 0.9)
    bare = replace(far, masks=())  # speaks against every triangle, with its ease
    params = LiftParams("literal", visibility_distance=2.0)
    evidence, cluster, kept = literal_kept(plane(), [near, bare], params)
    mean = projection_scores(evidence)
    for face, owner, share in zip(kept.face, kept.cluster, kept.share, strict=True):
        seen = slice(evidence.starts[face], evidence.starts[face + 1])
        against = evidence.ease[seen][evidence.projection[seen] < 0].sum()
        plus = mean[evidence.projection[seen].max()]
        assert cluster[evidence.projection[seen].max()] == owner
        assert share == pytest.approx(plus / (plus + against), abs=1e-5)


def test_instances_of_two_classes_may_overlap_until_faces_get_one_label_each() -> None:
    # Each class is seen by one photo; both keep the middle, and one label is left of it.
    views = [
        two_boxes(0.9, 0.9).with_masks(two_boxes(0.9, 0.9, 2).masks[k : k + 1]) for k in (0, 1)
    ]
    params = LiftParams("literal", threshold=0.3)
    evidence, cluster, kept = literal_kept(plane(), views, params)
    shared = np.bincount(kept.face)
    assert (shared == 2).sum() == 32
    winner, _ = best_cluster(kept, len(evidence.faces))
    assert (winner >= 0).all()
    assert set(np.unique(winner)) <= set(cluster.tolist())
