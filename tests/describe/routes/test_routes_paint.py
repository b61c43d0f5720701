"""Holds are linked by paint in light that is too uneven to name colours."""

from __future__ import annotations

import numpy as np
import pytest

from walltopo.describe.routes.grouping import (
    FLATTEN,
    REACH,
    balanced_paint,
    cues_of,
    group_by_paint,
    link_weights,
    may_be_linked,
    strongest_links,
)
from walltopo.images.colour import linear_from_srgb8
from walltopo.scans.pictures import SceneLight

PAIR = np.array([[0, 1]])
RED, ORANGE, GREY = (190, 25, 35), (240, 110, 20), (125, 125, 125)


def linear(*colours: tuple[int, int, int]) -> np.ndarray:
    return linear_from_srgb8(np.array(colours, dtype=np.uint8))


def straight(points: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    flat = points * [1, 1, FLATTEN]
    return np.linalg.norm(flat[pairs[:, 0]] - flat[pairs[:, 1]], axis=1)


def link(place: tuple[float, float], paint: np.ndarray) -> float:
    """Return the link of a hold at the origin to one at (x, z)."""
    points = np.array([[0.0, 0, 0], [place[0], 0, place[1]]])
    pairs = np.array([[0, 1]])
    return float(link_weights(cues_of(points, paint, pairs, straight(points, pairs)))[0])


def test_links_fade_with_distance_and_with_paint() -> None:
    even = np.ones((2, 3))
    same, other = balanced_paint(linear(RED, RED), even), balanced_paint(linear(RED, ORANGE), even)
    assert link((0.1, 0.4), same) > 0.5
    assert link((0.1, 0.4), same) > link((0.6, 0.4), same) > link((1.2, 0.4), same)
    assert link((0.1, 0.4), other) < 0.1
    assert link((REACH + 0.01, 0.0), same) == 0


def test_the_wall_tells_paint_from_light() -> None:
    """Grey holds, one in warm and one in blue light, on a grey wall: one paint."""
    light = np.array([[1.3, 1.0, 0.7], [0.7, 1.0, 1.4], [1.0, 1.0, 1.0]])
    seen = linear(GREY, GREY, GREY) * light
    raw, balanced = balanced_paint(seen, np.ones((3, 3))), balanced_paint(seen, light)
    assert np.linalg.norm(raw[0, :2] - raw[1, :2]) > 0.1
    assert np.linalg.norm(balanced[0, :2] - balanced[1, :2]) < 0.01


def test_a_wall_of_one_tint_changes_nothing() -> None:
    seen = linear(RED, ORANGE, GREY)
    assert balanced_paint(seen, np.full((3, 3), [1.5, 1.0, 0.6])) == pytest.approx(
        balanced_paint(seen, np.ones((3, 3)))
    )


def test_tint_is_that_of_the_wall_nearby() -> None:
    points = np.array([[0.0, 0, 0], [0.2, 0, 0], [9.0, 0, 0]])
    colour = np.log(np.array([[0.4, 0.2, 0.1], [0.4, 0.2, 0.1], [0.1, 0.1, 0.1]]))
    light = SceneLight(np.zeros((1, 3)), points, colour, 0.2)
    warm, neutral = light.tint_at(np.array([[0.1, 0, 0], [9.1, 0, 0]]), 1.0)
    assert warm == pytest.approx([2.0, 1.0, 0.5])
    assert neutral == pytest.approx([1.0, 1.0, 1.0])
    far = light.tint_at(np.array([[500.0, 0, 0]]), 1.0)  # no patch anywhere near
    assert far[0] == pytest.approx([1.0, 1.0, 1.0])


def test_no_wall_seen_means_no_tint() -> None:
    blind = SceneLight(np.zeros((1, 3)), np.zeros((0, 3)), np.zeros((0, 3)))
    assert (blind.tint_at(np.zeros((2, 3)), 1.0) == 1).all()


def test_routes_cross_from_warm_into_blue_light() -> None:
    """Two routes side by side; on the right half all is bluish, the wall too."""
    x = np.r_[np.linspace(0, 1.2, 8), np.linspace(0, 1.2, 8)]
    z = np.r_[np.linspace(0, 3, 8), np.linspace(0.3, 3.3, 8)]
    points = np.column_stack([x, 0 * x, z])
    tint = np.where(x[:, None] > 0.6, [[0.7, 1.0, 1.4]], [[1.2, 1.0, 0.8]])
    seen = linear(*[RED] * 8, *[GREY] * 8) * tint
    found = group_by_paint(
        points,
        balanced_paint(seen, tint),
        lambda pairs: straight(points, pairs),
        unit=1.0,
        resolution=1.0,
    )
    assert set(found.group[:8]).isdisjoint(set(found.group[8:]))


@pytest.mark.parametrize("unit", [0.5, 1.0, 3.0])
def test_scan_units_do_not_matter(unit: float) -> None:
    rng = np.random.default_rng(3)
    points = rng.uniform(0, 3, (20, 3))
    paint = balanced_paint(linear(*[RED, GREY] * 10), np.ones((20, 3)))

    def group(scale: float) -> list[int]:
        moved = points * scale
        found = group_by_paint(
            moved, paint, lambda pairs: straight(moved, pairs), unit=scale, resolution=2.5
        )
        return found.group.tolist()

    assert group(unit) == group(1.0)


def test_pairs_are_left_out_only_where_no_path_could_link_them() -> None:
    rng = np.random.default_rng(0)
    points = rng.uniform(0, 3, (60, 3))
    paint = rng.normal(0, 0.15, (60, 3))
    pairs = np.array([(a, b) for a in range(60) for b in range(a)], dtype=np.int64)
    kept = may_be_linked(points, paint, pairs)
    assert 0.05 < kept.mean() < 0.8
    for share in np.linspace(0, 1, 7):  # from the straight line to beyond what is ever linked
        length = straight(points, pairs) * (1 - share) + (REACH + 0.1) * share
        linked = link_weights(cues_of(points, paint, pairs, length)) > 0
        assert not (linked & ~kept).any()


def test_two_holds_are_as_similar_as_their_most_similar_paints() -> None:
    rng = np.random.default_rng(3)
    points, count = rng.uniform(0, 1.5, (12, 3)), 12
    paint = rng.normal(0, 0.2, (count, 3))
    second = np.where(rng.random((count, 1)) < 0.4, rng.normal(0, 0.2, (count, 3)), np.nan)
    pairs = np.stack(np.triu_indices(count, 1), axis=1)
    lengths = straight(points, pairs)
    found = strongest_links(points, paint, second, pairs, lengths)

    def own_link(row: int, paints: list[np.ndarray]) -> float:
        cues = cues_of(points[pairs[row]], np.array(paints), PAIR, lengths[[row]])
        return float(link_weights(cues)[0])

    for row, (one, two) in enumerate(pairs.tolist()):
        options = [
            own_link(row, [a, b])
            for a in (paint[one], second[one])
            for b in (paint[two], second[two])
            if np.isfinite(a).all() and np.isfinite(b).all()
        ]
        assert found[row] == pytest.approx(max(options))


def test_a_hold_of_two_colours_joins_the_route_of_either() -> None:
    """A red column whose third hold is white with a red part."""
    points = np.array([[0.1 * (k % 2), 0.0, 0.4 * k] for k in range(6)])
    paint = balanced_paint(linear(RED, RED, (220, 220, 215), RED, RED, RED), np.ones((6, 3)))
    second = np.full((6, 3), np.nan)

    def groups(second: np.ndarray) -> list[int]:
        found = group_by_paint(
            points,
            paint,
            lambda pairs: straight(points, pairs),
            unit=1.0,
            resolution=0.5,
            second=second,
        )
        return found.group.tolist()

    assert groups(second)[2] != groups(second)[1]
    second[2] = paint[0]
    assert len(set(groups(second))) == 1
