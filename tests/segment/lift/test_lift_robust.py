"""The robust method: what it finds, what it survives, what it promises."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from walltopo.core import InputError, Mask, Mesh, View
from walltopo.geometry.topology import face_neighbours
from walltopo.segment.lift import LiftParams, lift
from walltopo.segment.lift.label_image import STEPS, reach_of, stamp_borders
from walltopo.segment.lift.robust import fill_pinholes
from walltopo.segment.lift.settings import Method
from walltopo.segment.lift.vote import potts_clusters, tidy_order

Bumps = tuple[Mesh, list[View], np.ndarray]


def overlaps(found: Any, truth: np.ndarray) -> list[float]:
    """Best IoU of each true object, by faces."""
    best = []
    for number in range(1, int(truth.max()) + 1):
        own = truth == number
        ious = [
            (own & (found.face_instance == r.id)).sum()
            / (own | (found.face_instance == r.id)).sum()
            for r in found.records
        ]
        best.append(max(ious, default=0.0))
    return best


def test_exact_masks_give_the_objects(three_bumps: Bumps) -> None:
    mesh, views, truth = three_bumps
    found = lift(mesh, views)
    assert len(found) == 3
    assert min(overlaps(found, truth)) > 0.85
    for record in found.records:
        assert record.label == 1
        assert 0.5 < record.score <= 0.9
        assert sum(record.votes.values()) == pytest.approx(1.0)
        assert all(mask < len(views[view].masks) for view, mask in record.views)


def test_masks_over_two_objects_do_not_join_them(three_bumps: Bumps) -> None:
    mesh, views, truth = three_bumps
    spoilt = []
    for number, view in enumerate(views):
        full = [mask.full() for mask in view.masks]
        if number in (1, 4) and len(full) == 3:
            fused = Mask.from_full(full[0] | full[1], 1, 0.95)
            spoilt.append(view.with_masks((fused, view.masks[2])))
        else:
            spoilt.append(view)
    found = lift(mesh, spoilt)
    assert len(found) == 3
    assert min(overlaps(found, truth)) > 0.8


def test_a_class_that_is_wrong_in_some_photos_is_outvoted(three_bumps: Bumps) -> None:
    mesh, views, _ = three_bumps
    spoilt = [
        view.with_masks(tuple(replace(m, label=2 if k == 0 else 1) for m in view.masks))
        for k, view in enumerate(views)
    ]
    found = lift(mesh, spoilt)
    assert [record.label for record in found.records] == [1, 1, 1]
    assert any(2 in record.votes for record in found.records)


def test_classes_clustered_apart_make_two_of_one(three_bumps: Bumps) -> None:
    mesh, views, _ = three_bumps
    spoilt = [
        view.with_masks(tuple(replace(m, label=1 + k % 2) for m in view.masks))
        for k, view in enumerate(views)
    ]
    params = LiftParams(threshold=0.0, rounds=0)
    assert len(lift(mesh, spoilt, params)) == 3
    votes = [r.votes for r in lift(mesh, spoilt, replace(params, by_class=True)).records]
    assert len(votes) > 3
    assert all(len(shares) == 1 for shares in votes)


def test_what_a_photo_cannot_see_is_no_disagreement(three_bumps: Bumps) -> None:
    """Half of the photos end in the middle of the objects, and so do their masks."""
    mesh, views, _ = three_bumps
    cut = []
    for number, view in enumerate(views):
        if number % 2:
            camera = replace(view.camera, width=48)
            masks = tuple(Mask.from_full(m.full()[:, :48], 1, 0.9) for m in view.masks)
            view = replace(view, camera=camera, masks=masks)
        cut.append(view)
    params = LiftParams(cohesion=0.6, rounds=0, min_support=0.0)
    together, apart = lift(mesh, cut, params), lift(mesh, cut, replace(params, overlap="all"))
    assert len(together) < len(apart)


def test_photos_that_missed_an_object_vote_only_where_all_vote(three_bumps: Bumps) -> None:
    mesh, views, truth = three_bumps
    missed = [view if k < 3 else view.with_masks(()) for k, view in enumerate(views)]
    params = LiftParams(min_support=0.0)
    found = lift(mesh, missed, params)
    assert min(overlaps(found, truth)) > 0.7
    assert max(overlaps(lift(mesh, missed, replace(params, voters="all")), truth)) < 0.5


def test_a_mask_that_one_photo_invents_is_dropped(three_bumps: Bumps) -> None:
    mesh, views, _ = three_bumps
    blob = np.zeros((72, 96), dtype=np.bool_)
    blob[30:40, 40:52] = True
    bare = [view.with_masks(()) for view in views[1:]]
    assert len(lift(mesh, [views[0].with_masks((Mask.from_full(blob, 1),)), *bare])) == 0


@pytest.mark.parametrize("scale", [0.01, 100.0])
@pytest.mark.parametrize("method", ["robust", "literal"])
def test_normalised_lengths_make_scale_irrelevant(
    three_bumps: Bumps, scale: float, method: Method
) -> None:
    mesh, views, _ = three_bumps
    params = LiftParams(method=method, normalised=True)
    before = lift(mesh, views, params)
    scaled = []
    for view in views:
        pose = view.cam_from_world.copy()
        pose[:, 3] *= scale
        scaled.append(replace(view, cam_from_world=pose))
    after = lift(Mesh(mesh.vertices * scale, mesh.faces), scaled, params)
    assert len(before) == 3
    np.testing.assert_array_equal(before.face_instance, after.face_instance)
    np.testing.assert_allclose(before.face_score, after.face_score, atol=1e-5)


def test_threads_do_not_change_the_result(
    three_bumps: Bumps, monkeypatch: pytest.MonkeyPatch
) -> None:
    import numba

    mesh, views, _ = three_bumps
    many = lift(mesh, views)
    before = numba.get_num_threads()
    monkeypatch.setattr("os.sched_getaffinity", lambda _: {0})
    numba.set_num_threads(1)
    try:
        one = lift(mesh, views)
    finally:
        numba.set_num_threads(before)
    np.testing.assert_array_equal(one.face_instance, many.face_instance)
    np.testing.assert_array_equal(one.face_score, many.face_score)
    assert one.records == many.records


def test_photos_in_another_resolution_than_their_masks(three_bumps: Bumps) -> None:
    mesh, views, truth = three_bumps
    doubled = []
    for view in views:
        large = [np.kron(m.full(), np.ones((2, 2), dtype=np.bool_)) for m in view.masks]
        doubled.append(view.with_masks(tuple(Mask.from_full(b, 1, 0.9) for b in large)))
    assert min(overlaps(lift(mesh, doubled), truth)) > 0.85


# ---------------------------------------------------------------- awkward inputs


def test_nothing_to_lift_gives_no_instances(three_bumps: Bumps) -> None:
    mesh, views, _ = three_bumps
    empty = Mask.from_full(np.zeros((72, 96), dtype=np.bool_), 1)
    for given in ([], [view.with_masks(()) for view in views], [views[0].with_masks((empty,))]):
        assert len(lift(mesh, given)) == 0
        assert len(lift(mesh, given).face_instance) == len(mesh.faces)


def test_a_mesh_without_triangles_is_refused(three_bumps: Bumps) -> None:
    nothing = Mesh(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int32))
    with pytest.raises(InputError, match="triangles"):
        lift(nothing, three_bumps[1])


def test_vertices_that_are_not_numbers_are_refused() -> None:
    with pytest.raises(InputError, match="NaN"):
        Mesh(np.array([[0, 0, np.nan], [1, 0, 0], [0, 1, 0]]), np.array([[0, 1, 2]], np.int32))


def test_cameras_in_another_frame_are_reported(three_bumps: Bumps) -> None:
    mesh, views, _ = three_bumps
    away = Mesh(mesh.vertices + np.array([1000.0, 0, 0]), mesh.faces)
    with pytest.raises(InputError, match="frame"):
        lift(away, views, LiftParams(normalised=True))


@pytest.mark.parametrize("method", ["robust", "literal"])
def test_duplicate_and_flat_triangles_change_nothing(three_bumps: Bumps, method: Method) -> None:
    mesh, views, _ = three_bumps
    params = LiftParams(method=method)
    plain = lift(mesh, views, params)
    copies = mesh.faces[plain.face_instance > 0][::3]
    flat = np.stack([mesh.faces[:50, 0], mesh.faces[:50, 0], mesh.faces[:50, 1]], axis=1)
    both = Mesh(mesh.vertices, np.concatenate([mesh.faces, copies, flat]))
    found = lift(both, views, params)
    count = len(mesh.faces)
    np.testing.assert_array_equal(found.face_instance[:count], plain.face_instance)
    assert (found.face_instance[count : count + len(copies)] > 0).all()
    assert (found.face_instance[count + len(copies) :] == 0).all()


def test_a_mask_of_the_whole_photo_and_a_camera_in_the_mesh(three_bumps: Bumps) -> None:
    mesh, views, _ = three_bumps
    full = Mask.from_full(np.ones((72, 96), dtype=np.bool_), 1)
    found = lift(mesh, [view.with_masks((full,)) for view in views])
    assert len(found) >= 1
    inside = views[0].cam_from_world.copy()
    inside[:, 3] = -inside[:, :3] @ mesh.centroids[500]
    lift(mesh, [*views, replace(views[0], cam_from_world=inside)])


def test_65000_masks_in_one_photo(three_bumps: Bumps) -> None:
    mesh, views, _ = three_bumps
    dot = np.ones((1, 1), dtype=np.bool_)
    masks = tuple(Mask(dot, k % 1280, k // 1280, 1280, 960, 1, 0.5) for k in range(65_000))
    found = lift(mesh, [views[0].with_masks(masks), *views[1:]])
    assert len(found) >= 3


# ---------------------------------------------------------------- parts


def test_small_masks_lie_on_top_and_duplicates_go() -> None:
    def box(x0: int, x1: int, score: float) -> Mask:
        bitmap = np.zeros((20, 40), dtype=np.bool_)
        bitmap[5:15, x0:x1] = True
        return Mask.from_full(bitmap, 1, score)

    from walltopo.core import Camera

    view = View("a.jpg", Camera("PINHOLE", 40, 20, (30, 30, 20, 10)), np.eye(3, 4))
    view = view.with_masks((box(10, 14, 0.9), box(0, 30, 0.4), box(0, 29, 0.8)))
    assert tidy_order(view, "small", drop_duplicates=True) == [2, 0]
    assert tidy_order(view, "small", drop_duplicates=False) == [1, 2, 0]
    assert tidy_order(view, "surest", drop_duplicates=False) == [1, 2, 0]
    nested = view.with_masks((box(10, 14, 0.3), box(0, 30, 0.4)))
    assert tidy_order(nested, "surest", drop_duplicates=True) == [0, 1]


def test_distances_to_a_border() -> None:
    labels = np.full((9, 20), -1, dtype=np.int32)
    labels[:, :10] = 3
    code, distance = labels.copy(), np.full(labels.shape, 4 * STEPS, dtype=np.uint8)
    stamp_borders(labels, np.array([[3, 0, 9, 0, 10]], np.int32), reach_of(4.0), code, distance)
    expected = np.minimum(np.abs(np.arange(20) + 0.5 - 10.0), 4.0)
    np.testing.assert_allclose(distance[4] / STEPS, expected)
    assert set(code[4, 10:14]) == {-2 - 3}
    assert set(code[4, 15:]) == {-1}


def test_potts_clusters_do_not_depend_on_what_else_there_is() -> None:
    def cliques(count: int) -> tuple[list[int], list[int], list[float]]:
        edges = [
            (c * 6 + a, c * 6 + b, 0.7) for c in range(count) for a in range(6) for b in range(a)
        ]
        edges += [(c * 6, c * 6 + 6, 0.5) for c in range(count - 1)]  # one bad mask each
        first, second, weight = zip(*edges, strict=True)
        return list(first), list(second), list(weight)

    for count in (2, 40):
        first, second, weight = cliques(count)
        found = potts_clusters(
            6 * count, np.array(first, np.int32), np.array(second, np.int32), np.array(weight), 0.25
        )
        np.testing.assert_array_equal(found, np.repeat(np.arange(count), 6))


def test_pinholes() -> None:
    # A strip of 12 triangles: each shares an edge with the next.
    faces = np.array([[k, k + 1, k + 2] for k in range(12)], dtype=np.int32)
    neighbours = face_neighbours(faces)
    assert sorted(neighbours[5].tolist()) == [-1, 4, 6]
    areas = np.ones(12)
    winner = np.array([0, 0, 0, 0, -1, 0, 0, 1, 1, 1, 1, 0], dtype=np.int32)
    # The strip's sides are the end of what masks touched: no hole. A closed ring has one.
    assert fill_pinholes(neighbours, areas, winner).tolist() == winner.tolist()
    closed = np.where(neighbours < 0, (np.arange(12) - 1).clip(0)[:, None], neighbours)
    many = np.full(12, 30.0)
    many[4] = 1.0
    assert fill_pinholes(closed.astype(np.int32), many, winner)[4] == 0
