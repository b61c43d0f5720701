"""The routes of a wall: groups of holds, in climbing order, with their figures."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh, Progress, Silent
from walltopo.core.parallel import available_cores
from walltopo.describe.routes.geodesic import pair_lengths
from walltopo.describe.routes.grouping import (
    FLATTEN,
    RESOLUTION,
    Grouping,
    balanced_paint,
    group_by_paint,
    group_holds,
)
from walltopo.describe.routes.proxy import PROXY_FACES, build_proxy
from walltopo.describe.routes.start_and_top import (
    WallStats,
    bottom_to_top,
    find_start_and_top,
    wall_stats,
)
from walltopo.describe.settings import RoutesSettings
from walltopo.images.colour import linear_from_srgb8
from walltopo.scans.document import Rgb
from walltopo.scans.edits import RoleName
from walltopo.scans.holds import UNKNOWN, Hold
from walltopo.scans.routes import Ambiguous, Route

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def _group(mesh: Mesh, holds: Sequence[Hold], settings: RoutesSettings, unit: float) -> Grouping:
    points = np.array([hold.position for hold in holds], dtype=np.float64).reshape(-1, 3)
    proxy = build_proxy(mesh.vertices, mesh.faces, points, PROXY_FACES)
    threads = settings.threads or available_cores()

    gap = settings.bridge_gap * unit
    if settings.link == "paint":
        paint, second = paints_of(holds)
        return group_by_paint(
            points,
            paint,
            lambda pairs: pair_lengths(proxy, pairs, FLATTEN, gap, threads),
            unit=unit,
            resolution=RESOLUTION,
            seed=settings.seed,
            second=second,
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


def paints_of(holds: Sequence[Hold]) -> tuple[Floats, Floats]:
    """Return the (n, 3) first and second paint of holds, see `group_by_paint`."""
    two = [k for k, hold in enumerate(holds) if hold.second_colour]
    rgb = [hold.colour_rgb for hold in holds] + [holds[k].second_rgb for k in two]
    tint = [hold.wall_tint for hold in holds] + [holds[k].wall_tint for k in two]
    both = balanced_paint(linear_from_srgb8(np.array(rgb, dtype=np.uint8)), np.array(tint))
    second = np.full((len(holds), 3), np.nan)
    second[two] = both[len(holds) :]
    return both[: len(holds)], second


def find_routes(
    mesh: Mesh,
    holds: Sequence[Hold],
    settings: RoutesSettings,
    *,
    unit: float = 1.0,
    left_out: Sequence[Hold] = (),
    progress: Progress | None = None,
) -> tuple[list[Route], list[int]]:
    """Return the routes found by grouping holds, and the holds without a route.

    Only holds with role "hold" and a known colour take part. Volumes belong to every route,
    downclimb holds to none, and a hold that no photo shows has no known colour.

    Parameters
    ----------
    unit : scan units per metre.
    left_out : low-confidence instances; one near the start or top of a route may be its hold.

    Returns
    -------
    The routes, numbered from left to right, and the ids of holds without a route (sorted;
    downclimb holds are excluded).
    """
    progress = progress or Silent()
    climbed = [hold for hold in holds if hold.role == "hold" and hold.colour != UNKNOWN]
    grouping = Grouping(np.zeros(0, dtype=np.int64), np.zeros((0, 0)))
    if climbed:
        progress.step("find paths between holds", len(climbed))
        grouping = _group(mesh, climbed, settings, unit)
        progress.advance(len(climbed))
    return describe_groups(holds, climbed, grouping, settings, left_out)


def describe_groups(
    holds: Sequence[Hold],
    climbed: Sequence[Hold],
    grouping: Grouping,
    settings: RoutesSettings,
    left_out: Sequence[Hold] = (),
) -> tuple[list[Route], list[int]]:
    """Return routes of groups of holds, and ids of holds without a route: see `find_routes`.

    Parameters
    ----------
    climbed : the holds of the grouping, in its order.
    """
    route_of = _number_routes(climbed, grouping.group, settings.min_holds) if climbed else {}
    group = np.array([route_of.get(hold.id, 0) for hold in climbed], dtype=np.int64)
    shares = memberships(grouping.similarity, group)
    rows_of = {
        number: np.flatnonzero(group == number).tolist() for number in sorted({*route_of.values()})
    }
    members = {number: [climbed[row] for row in rows] for number, rows in rows_of.items()}
    unrouted = [hold for hold in holds if hold.role == "hold" and hold.id not in route_of]
    wall = wall_stats(list(members.values()), holds).with_strays(unrouted, left_out)
    routes = []
    for number, rows in rows_of.items():
        ambiguous: dict[int, dict[int, float]] = {}
        for row in rows:
            rivals = _rival_routes(shares[row], number, settings.ambiguous_above)
            ambiguous |= {climbed[row].id: rivals} if rivals else {}
        routes.append(describe_route(number, members[number], wall, ambiguous))
    return routes, sorted(hold.id for hold in unrouted)


def _number_routes(holds: Sequence[Hold], group: Ints, min_holds: int) -> dict[int, int]:
    """Return hold id to route id, for groups of enough holds, numbered from left to right."""
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
    """Return (n,) how far right each hold is, along the main horizontal direction of the holds."""
    flat = np.array([hold.position[:2] for hold in holds])
    flat = flat - flat.mean(axis=0)
    _, _, axes = np.linalg.svd(flat, full_matrices=False)
    out = np.mean([hold.normal[:2] for hold in holds], axis=0)
    # Seen from the front, right is up x out of the wall.
    right = np.array([-out[1], out[0]])
    return flat @ (axes[0] if axes[0] @ right >= 0 else -axes[0])


def _rival_routes(shares: Floats, own: int, above: float) -> dict[int, float]:
    """Return route id to probability if another route is likely enough, else an empty dict."""
    rivals = shares.copy()
    rivals[[0, own]] = 0  # column 0: holds without a route
    if rivals.max(initial=0.0) < max(above, 1e-9):
        return {}
    found = {int(k): float(shares[k]) for k in np.flatnonzero(shares) if k > 0}
    total = sum(found.values())
    return {k: p / total for k, p in sorted(found.items(), key=lambda item: -item[1])}


STRONGEST = 3  # number of strongest links that count for a hold's membership of a route


def route_facts(holds: Sequence[Hold], hands: Sequence[Hold]) -> dict[str, Any]:
    """Return the figures of a route.

    Returns
    -------
    length : polyline through the hand holds from bottom to top.
    steepness_deg : mean wall angle under its holds.
    steepness_profile : [height above the lowest hold in metres, degrees] per hand hold.
    largest_move : longest distance from a hand hold to the nearest lower one.
    holds_by_type : type to count.
    """
    points = np.array([hold.position for hold in hands]).reshape(-1, 3)
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    reach = [
        float(np.linalg.norm(points[:k] - points[k], axis=1).min()) for k in range(1, len(points))
    ]
    base = min(hold.position[2] for hold in holds)
    return {
        "length": round(float(steps.sum()), 3),
        "steepness_deg": round(float(np.mean([hold.steepness_deg for hold in holds])), 1),
        "steepness_profile": tuple(
            (round(hold.position[2] - base, 3), round(hold.steepness_deg, 1)) for hold in hands
        ),
        "largest_move": round(max(reach, default=0.0), 3),
        "holds_by_type": dict(sorted(Counter(hold.type for hold in holds).items())),
    }


def memberships(links: Floats, group: Ints) -> Floats:
    """Return how well each hold fits each group.

    Parameters
    ----------
    links : (n, n) similarity in [0, 1]; group : (n,) group numbers, -1 = none.

    Returns
    -------
    (n, groups) float64, rows sum to 1 (or 0 for holds without any link): squared mean of a
    hold's strongest links into each group, normalised. The square keeps a hold in the middle of
    its route from being ambiguous because of a distant neighbour.
    """
    count = int(group.max(initial=-1)) + 1
    fit = np.zeros((len(group), count))
    for number in range(count):
        columns = links[:, group == number]
        kept = min(STRONGEST, columns.shape[1])
        fit[:, number] = (np.sort(columns, axis=1)[:, -kept:].sum(axis=1) / STRONGEST) ** 2
    total = fit.sum(axis=1, keepdims=True)
    return np.divide(fit, total, out=np.zeros_like(fit), where=total > 0)


def colour_of(holds: Sequence[Hold]) -> tuple[str, Rgb]:
    """Return the colour of most of the holds, and the median RGB of the holds with that colour."""
    names = [hold.colour for hold in holds]
    name = max(sorted(set(names)), key=names.count)
    paints = [hold.colour_rgb for hold in holds if hold.colour == name]
    red, green, blue = np.median(paints, axis=0).round().astype(int).tolist()
    return name, (red, green, blue)


def describe_route(
    number: int,
    holds: Sequence[Hold],
    wall: WallStats,
    ambiguous: Mapping[int, Mapping[int, float]] | None = None,
    roles: Mapping[int, RoleName] | None = None,
) -> Route:
    """Return the route of a group of holds: ordered, with start, top, footholds and figures.

    If a route has only footholds, all its holds count as hand holds.

    Parameters
    ----------
    wall : the usual figures of the wall (see `wall_stats`).
    ambiguous : hold id to its probability by route id.
    roles : the setter's role of a hold, also of volumes, which are not among `holds`. An entry
        replaces the found role of that hold alone.
    """
    given = roles or {}
    ordered = bottom_to_top(holds)
    ends = find_start_and_top(ordered, wall, ambiguous or {}, number)
    found: dict[RoleName, set[int]] = {
        "start": {hold.id for hold in ends.start},
        "top": {ends.top.id},
        "foot": {hold.id for hold in ends.feet},
        "zone": set(),
    }
    known = [hold.id for hold in ordered]
    known += [hold for hold in given if hold not in known]

    def with_role(role: RoleName) -> tuple[int, ...]:
        return tuple(
            hold for hold in known if given.get(hold) == role or hold in found[role] - given.keys()
        )

    feet = with_role("foot")
    hands = [hold for hold in ordered if hold.id not in feet] or ordered
    colour, rgb = colour_of(ordered)
    return Route(
        id=number,
        colour=colour,
        colour_rgb=rgb,
        holds=tuple(hold.id for hold in ordered),
        start=with_role("start"),
        top=with_role("top"),
        zone=with_role("zone"),
        footholds=feet,
        doubtful_start="" if "start" in given.values() else ends.start_confidence.reason,
        doubtful_top="" if "top" in given.values() else ends.top_confidence.reason,
        ambiguous=tuple(
            Ambiguous(hold, {str(route): round(p, 3) for route, p in shares.items()})
            for hold, shares in (ambiguous or {}).items()
        ),
        **route_facts(ordered, hands),
    )
