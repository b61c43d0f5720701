"""Routes from holds: grouping, roles, edge cases."""

from __future__ import annotations

from pathlib import Path

import networkx
import numpy as np
import pytest
from flat_wall import METRES, wall  # type: ignore[import-not-found]
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec.structs import replace

from walltopo.core import InputError, Mesh, SettingsError
from walltopo.describe.routes.find import find_routes
from walltopo.describe.routes.grouping import (
    best_louvain,
    candidate_pairs,
    group_holds,
    modularity,
    similarity,
)
from walltopo.describe.settings import RoutesSettings
from walltopo.geometry.mesh_files import write_ply
from walltopo.pipeline.runner import run_stage
from walltopo.scans.folder import ScanFolder
from walltopo.scans.holds import Hold, Holds
from walltopo.scans.routes import Routes
from walltopo.scans.scale import TYPICAL_HOLD, unit_of

BY_NAME = RoutesSettings(link="colour")


def column(x: float, colour: str, first: int, count: int = 8) -> list[Hold]:
    """A straight route up the wall at x."""
    return [
        Hold(
            first + k,
            "hold",
            position=(x + 0.15 * (-1) ** k, 0.0, 0.3 + 0.45 * k),
            colour=colour,
            size=0.15,
        )
        for k in range(count)
    ]


def test_two_routes_of_one_colour_and_one_of_another() -> None:
    holds = column(1.0, "red", 1) + column(5.5, "red", 21) + column(1.4, "blue", 41)
    routes, unrouted = find_routes(wall(), holds, BY_NAME)
    assert [(route.colour, route.holds[0], len(route.holds)) for route in routes] == [
        ("red", 1, 8),
        ("blue", 41, 8),
        ("red", 21, 8),
    ]
    assert unrouted == []
    assert routes[0].holds == tuple(range(1, 9))
    assert routes[0].top == (8,)


def test_volumes_downclimb_and_unknown_colours_are_in_no_route() -> None:
    holds = [
        *column(1.0, "red", 1),
        Hold(50, "volume", position=(1.0, 0.0, 2.0), colour="red", role="volume"),
        Hold(51, "hold", position=(1.2, 0.0, 2.0), colour="red", role="downclimb"),
        Hold(52, "hold", position=(1.4, 0.0, 2.0), colour="unknown"),
    ]
    routes, unrouted = find_routes(wall(), holds, BY_NAME)
    assert routes[0].holds == tuple(range(1, 9))
    assert unrouted == [52]


def test_a_route_with_one_hold_is_left_without_a_route_unless_requested() -> None:
    holds = [*column(1.0, "red", 1), *column(6.0, "green", 30, count=1)]
    routes, unrouted = find_routes(wall(), holds, BY_NAME)
    assert len(routes) == 1
    assert unrouted == [30]
    routes, unrouted = find_routes(wall(), holds, RoutesSettings(link="colour", min_holds=1))
    assert [route.holds for route in routes][1] == (30,)
    assert routes[1].start == routes[1].top == (30,)
    assert routes[1].length == 0.0
    assert unrouted == []


def test_linking_by_paint_needs_no_colour_names() -> None:
    def painted(holds: list[Hold], rgb: tuple[int, int, int]) -> list[Hold]:
        # The light falls off from the bottom to the top of the wall.
        return [
            replace(
                hold,
                colour="?",
                colour_rgb=tuple(int(v * (1 - 0.12 * hold.position[2])) for v in rgb),
            )
            for hold in holds
        ]

    holds = [
        *painted(column(1.0, "", 1), (200, 30, 40)),
        *painted(column(1.4, "", 21), (40, 80, 190)),
        *painted(column(5.0, "", 41), (200, 30, 40)),
    ]
    routes, _ = find_routes(wall(), holds, RoutesSettings(link="paint"))
    found = sorted(tuple(sorted(route.holds)) for route in routes)
    assert found == [tuple(range(1, 9)), tuple(range(21, 29)), tuple(range(41, 49))]


def test_holds_on_disconnected_parts_share_no_route() -> None:
    mesh = wall(width=2.0)
    count = len(mesh.vertices)
    # A second wall 1.2 m behind the first: near in space, not joined.
    behind = mesh.vertices + np.array([0.0, 1.2, 0.0])
    both = Mesh(np.vstack([mesh.vertices, behind]), np.vstack([mesh.faces, mesh.faces + count]))
    front = column(1.0, "red", 1)
    back = [
        replace(hold, id=hold.id + 20, position=(hold.position[0], 1.2, hold.position[2]))
        for hold in front
    ]
    routes, unrouted = find_routes(both, [*front, *back], BY_NAME)
    found = sorted(tuple(sorted(route.holds)) for route in routes)
    assert found == [tuple(range(1, 9)), tuple(range(21, 29))]
    assert unrouted == []


def test_no_holds_no_routes() -> None:
    assert find_routes(wall(), [], BY_NAME) == ([], [])


def test_unscaled_scan_gives_the_same_routes() -> None:
    holds = column(1.0, "red", 1) + column(5.5, "red", 21)
    mesh = wall()
    factor = 7.3
    scaled = [
        Hold(
            hold.id,
            "hold",
            position=tuple(factor * v for v in hold.position),  # type: ignore[arg-type]
            colour=hold.colour,
            size=factor * hold.size,
        )
        for hold in holds
    ]
    one, _ = find_routes(mesh, holds, BY_NAME)
    two, _ = find_routes(
        Mesh(mesh.vertices * factor, mesh.faces),
        scaled,
        BY_NAME,
        unit=unit_of(scaled, False, TYPICAL_HOLD),
    )
    assert [route.holds for route in one] == [route.holds for route in two]


def test_a_hold_between_two_routes_is_ambiguous() -> None:
    middle = Hold(99, "hold", position=(2.75, 0.0, 1.9), colour="red", size=0.15)
    holds = [*column(1.5, "red", 1), *column(4.0, "red", 21), middle]
    routes, _ = find_routes(wall(), holds, BY_NAME)
    shares = [entry.routes for route in routes for entry in route.ambiguous if entry.hold == 99]
    assert len(routes) == 2
    assert len(shares) == 1
    assert sum(shares[0].values()) == pytest.approx(1.0)
    assert min(shares[0].values()) > 0.3


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(0.2, 3))
def test_louvain_depends_neither_on_the_run_nor_loses_nodes(seed: int, resolution: float) -> None:
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 30))
    weights = np.triu(rng.random((n, n)) * (rng.random((n, n)) < 0.3), 1)
    weights = weights + weights.T
    groups = best_louvain(weights, resolution, 0)
    np.testing.assert_array_equal(groups, best_louvain(weights, resolution, 0))
    assert sorted(np.unique(groups)) == list(range(groups.max() + 1))
    if weights.any():
        alone = np.arange(n)
        assert modularity(weights, groups, resolution) >= modularity(weights, alone, resolution)


def test_louvain_matches_networkx_modularity() -> None:
    graph = networkx.karate_club_graph()
    weights = networkx.to_numpy_array(graph, weight=None)
    groups = best_louvain(weights, 1.0, 0)
    sets = [set(np.flatnonzero(groups == k).tolist()) for k in range(groups.max() + 1)]
    theirs = networkx.community.modularity(graph, sets, weight=None)
    assert modularity(weights, groups, 1.0) == pytest.approx(theirs)
    assert theirs > 0.41


@given(st.floats(0, 5), st.floats(0, 5), st.lists(st.floats(0, 20), min_size=1))
def test_similarity_falls_from_one_to_zero(near: float, extra: float, lengths: list[float]) -> None:
    value = similarity(np.sort(np.array(lengths)), near, near + extra)
    assert ((value >= 0) & (value <= 1)).all()
    assert (np.diff(value) <= 0).all()
    assert similarity(np.array([near]), near, near + extra)[0] == 1
    assert similarity(np.array([np.inf]), near, near + extra)[0] == 0


def test_candidate_pairs_lose_no_pair_that_could_matter() -> None:
    rng = np.random.default_rng(0)
    points = rng.random((40, 3)) * 5
    labels = [str(k) for k in rng.integers(3, size=40)]
    pairs = {tuple(pair) for pair in candidate_pairs(points, labels, 0.4, 1.5).tolist()}
    for a in range(40):
        for b in range(a + 1, 40):
            near = np.linalg.norm((points[a] - points[b]) * [1, 1, 0.4]) < 1.5
            assert ((a, b) in pairs) == (near and labels[a] == labels[b])


def test_holds_without_a_path_are_not_grouped() -> None:
    points = np.array([[0.0, 0, 0], [0.1, 0, 0]])
    grouping = group_holds(
        points,
        ["red", "red"],
        lambda pairs: np.full(len(pairs), np.inf),
        near=1,
        far=2,
        ratio=1,
        resolution=1,
    )
    assert grouping.group.tolist() == [0, 1]


def test_settings_refuse_crossed_distances() -> None:
    with pytest.raises(SettingsError, match=r"routes\.max_hold_dist"):
        RoutesSettings(min_hold_dist=3.0, max_hold_dist=2.0)


def test_stage_reads_and_writes_the_scan_folder(tmp_path: Path) -> None:
    scan = ScanFolder(tmp_path)
    write_ply(scan.mesh, wall())
    holds = [*column(1.0, "red", 1), Hold(50, "volume", position=(4, 0, 2), role="volume")]
    METRES.save(scan.scale)
    Holds(metric=True, holds=tuple(holds)).save(scan.holds_raw)
    metrics = run_stage(scan, "routes", BY_NAME)
    assert metrics["routes"] == 1
    found = Routes.load(scan.routes_raw)
    assert found.volumes == (50,)
    assert found.routes[0].holds == tuple(range(1, 9))
    scan.holds_raw.write_text('{"metric": true, "holds": [{"id": 1}]}')
    with pytest.raises(InputError, match=r"holds\[0\]"):
        run_stage(scan, "routes", BY_NAME)
