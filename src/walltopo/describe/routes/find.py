"""The `routes` stage: which holds make a route."""

from __future__ import annotations

import os
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh, Progress, Silent
from walltopo.describe.routes.geodesic import pair_lengths
from walltopo.describe.routes.grouping import (
    FLATTEN,
    RESOLUTION,
    Grouping,
    balanced_paint,
    group_by_paint,
    group_holds,
)
from walltopo.describe.routes.order import describe_route, memberships
from walltopo.describe.routes.proxy import PROXY_FACES, build_proxy
from walltopo.describe.routes.settings import RoutesSettings
from walltopo.describe.routes.start_and_top import wall_of
from walltopo.images.colour import linear_from_srgb8
from walltopo.scans.attributes import UNKNOWN, Doubtful, Hold
from walltopo.scans.routes import Route

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def _group(mesh: Mesh, holds: Sequence[Hold], settings: RoutesSettings, unit: float) -> Grouping:
    points = np.array([hold.position for hold in holds], dtype=np.float64).reshape(-1, 3)
    proxy = build_proxy(mesh.vertices, mesh.faces, points, PROXY_FACES)
    threads = settings.threads or os.cpu_count() or 1

    gap = settings.bridge_gap * unit
    if settings.link == "paint":
        rgb = np.array([hold.colour_rgb for hold in holds], dtype=np.uint8)
        tint = np.array([hold.wall_tint for hold in holds])
        return group_by_paint(
            points,
            balanced_paint(linear_from_srgb8(rgb), tint),
            lambda pairs: pair_lengths(proxy, pairs, FLATTEN, gap, threads),
            unit=unit,
            resolution=RESOLUTION,
            seed=settings.seed,
        )
    return group_holds(
        points,
        [hold.colour for hold in holds],
        lambda pairs: pair_lengths(proxy, pairs, settings.flatten_ratio, gap, threads),
        near=settings.min_hold_dist * unit,
        far=settings.max_hold_dist * unit,
        ratio=settings.flatten_ratio,
        resolution=settings.resolution,
        seed=settings.seed,
    )


def find_routes(
    mesh: Mesh,
    holds: Sequence[Hold],
    settings: RoutesSettings,
    *,
    unit: float = 1.0,
    left_out: Sequence[Doubtful] = (),
    progress: Progress | None = None,
) -> tuple[list[Route], list[int]]:
    """Group holds into routes.

    Only holds of role "hold" and of a known colour take part: volumes belong to every
    route, downclimb holds to none, and a hold that no photo shows has no colour to go by.

    Parameters
    ----------
    unit : scan units in a metre.
    left_out : instances shown as no hold; one near an end of a route may be a hold of it.

    Returns
    -------
    The routes, numbered from left to right, and the ids of holds without a route (sorted;
    downclimb holds are not among them).
    """
    progress = progress or Silent()
    climbed = [hold for hold in holds if hold.role == "hold" and hold.colour != UNKNOWN]
    grouping = Grouping(np.zeros(0, dtype=np.int64), np.zeros((0, 0)))
    if climbed:
        progress.step("paths between holds", len(climbed))
        grouping = _group(mesh, climbed, settings, unit)
        progress.advance(len(climbed))
    return describe_groups(holds, climbed, grouping, settings, left_out)


def describe_groups(
    holds: Sequence[Hold],
    climbed: Sequence[Hold],
    grouping: Grouping,
    settings: RoutesSettings,
    left_out: Sequence[Doubtful] = (),
) -> tuple[list[Route], list[int]]:
    """Routes of groups of holds, and the ids of holds without a route: see `find_routes`.

    Parameters
    ----------
    climbed : the holds of the grouping, in its order.
    """
    route_of = _numbered(climbed, grouping.group, settings.min_holds) if climbed else {}
    group = np.array([route_of.get(hold.id, 0) for hold in climbed], dtype=np.int64)
    shares = memberships(grouping.similarity, group)
    rows_of = {
        number: np.flatnonzero(group == number).tolist() for number in sorted({*route_of.values()})
    }
    members = {number: [climbed[row] for row in rows] for number, rows in rows_of.items()}
    unrouted = [hold for hold in holds if hold.role == "hold" and hold.id not in route_of]
    wall = wall_of(list(members.values()), holds).beside(unrouted, left_out)
    routes = []
    for number, rows in rows_of.items():
        ambiguous: dict[int, dict[int, float]] = {}
        for row in rows:
            likely = _plausible(shares[row], number, settings.ambiguous_above)
            ambiguous |= {climbed[row].id: likely} if likely else {}
        routes.append(describe_route(number, members[number], wall, ambiguous))
    return routes, sorted(hold.id for hold in unrouted)


def _numbered(holds: Sequence[Hold], group: Ints, min_holds: int) -> dict[int, int]:
    """Hold id to route id: groups of enough holds, numbered from left to right from 1."""
    sizes = np.bincount(group)
    along = _along_the_wall(holds)
    kept = [number for number in range(len(sizes)) if sizes[number] >= min_holds]
    kept.sort(key=lambda number: (along[group == number].mean(), number))
    route = {number: k for k, number in enumerate(kept, start=1)}
    return {
        hold.id: route[number]
        for hold, number in zip(holds, group.tolist(), strict=True)
        if number in route
    }


def _along_the_wall(holds: Sequence[Hold]) -> Floats:
    """(n,) how far right each hold is: along the level direction in which holds extend most."""
    flat = np.array([hold.position[:2] for hold in holds])
    flat = flat - flat.mean(axis=0)
    _, _, axes = np.linalg.svd(flat, full_matrices=False)
    out = np.mean([hold.normal[:2] for hold in holds], axis=0)
    # Facing the wall, right is up x out of the wall.
    right = np.array([-out[1], out[0]])
    return flat @ (axes[0] if axes[0] @ right >= 0 else -axes[0])


def _plausible(shares: Floats, own: int, above: float) -> dict[int, float]:
    """Route id to probability if another route than its own is likely enough, else empty."""
    rivals = shares.copy()
    rivals[[0, own]] = 0  # column 0: holds without a route
    if rivals.max(initial=0.0) < max(above, 1e-9):
        return {}
    found = {int(k): float(shares[k]) for k in np.flatnonzero(shares) if k > 0}
    total = sum(found.values())
    return {k: p / total for k, p in sorted(found.items(), key=lambda item: -item[1])}
