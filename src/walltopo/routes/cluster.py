"""The `routes` stage: which holds make a route."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any

import numpy as np

from walltopo.core import Mesh, Progress, Silent
from walltopo.routes.geodesic import pair_lengths
from walltopo.routes.grouping import Grouping, group_holds
from walltopo.routes.order import describe_route, memberships
from walltopo.routes.params import RoutesSettings
from walltopo.routes.proxy import build_proxy
from walltopo.routes.records import Hold, Route, read_holds
from walltopo.routes.units import unit_of
from walltopo.workspace import ScanFolder, read_json, write_json

__all__ = ["find_routes", "run"]

UNKNOWN = "unknown"


def _group(mesh: Mesh, holds: Sequence[Hold], settings: RoutesSettings, unit: float) -> Grouping:
    points = np.array([hold.position for hold in holds], dtype=np.float64).reshape(-1, 3)
    proxy = build_proxy(mesh.vertices, mesh.faces, points, settings.proxy_faces)
    threads = settings.threads or os.cpu_count() or 1
    return group_holds(
        points,
        [hold.colour for hold in holds],
        lambda pairs: pair_lengths(
            proxy, pairs, settings.flatten_ratio, settings.bridge_gap * unit, threads
        ),
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
    metric: bool = True,
    progress: Progress | None = None,
) -> tuple[list[Route], list[int]]:
    """Group holds into routes.

    Only holds of role "hold" and of a known colour take part: volumes belong to every
    route, downclimb holds to none, and a hold that no photo shows has no colour to go by.

    Returns
    -------
    The routes, from left to right as numbered by their mean position along the wall, and the
    ids of holds without a route (sorted).
    """
    progress = progress or Silent()
    unit = unit_of(holds, metric, settings.typical_hold)
    climbed = [hold for hold in holds if hold.role == "hold" and hold.colour != UNKNOWN]
    unrouted = {hold.id for hold in holds if hold.role == "hold" and hold.colour == UNKNOWN}
    if not climbed:
        return [], sorted(unrouted)
    progress.step("paths between holds", len(climbed))
    grouping = _group(mesh, climbed, settings, unit)
    progress.advance(len(climbed))
    sizes = np.bincount(grouping.group)
    kept = [number for number in range(len(sizes)) if sizes[number] >= settings.min_holds]
    unrouted |= {
        hold.id
        for hold, number in zip(climbed, grouping.group, strict=True)
        if sizes[number] < settings.min_holds
    }
    order = _left_to_right(climbed, grouping, kept)
    return _describe(climbed, grouping, order, settings), sorted(unrouted)


def _left_to_right(holds: Sequence[Hold], grouping: Grouping, kept: Sequence[int]) -> list[int]:
    """Groups ordered along the horizontal direction in which the holds extend most."""
    flat = np.array([hold.position[:2] for hold in holds])
    flat = flat - flat.mean(axis=0)
    _, _, axes = np.linalg.svd(flat, full_matrices=False)
    axis = axes[0]
    # Facing the wall (against the mean normal), right is up x out of the wall.
    out = np.mean([hold.normal[:2] for hold in holds], axis=0)
    if axis @ np.array([-out[1], out[0]]) < 0:
        axis = -axis
    along = flat @ axis
    return sorted(kept, key=lambda number: (along[grouping.group == number].mean(), number))


def _describe(
    holds: Sequence[Hold], grouping: Grouping, order: Sequence[int], settings: RoutesSettings
) -> list[Route]:
    number_of = {group: k for k, group in enumerate(order, start=1)}
    shares = memberships(grouping.similarity, grouping.group)
    median = float(np.median([hold.size_m for hold in holds]))
    routes = []
    for group in order:
        rows = np.flatnonzero(grouping.group == group).tolist()
        ambiguous: dict[int, dict[int, float]] = {}
        for row in rows:
            mine = {number_of[g]: float(shares[row, g]) for g in order if shares[row, g] > 0}
            others = [share for g, share in mine.items() if g != number_of[group]]
            if max(others, default=0.0) >= max(settings.ambiguous_above, 1e-9):
                ambiguous[holds[row].id] = dict(sorted(mine.items(), key=lambda item: -item[1]))
        members = [holds[row] for row in rows]
        routes.append(
            describe_route(number_of[group], members[0].colour, members, median, ambiguous)
        )
    return routes


def run(scan: ScanFolder, settings: RoutesSettings, progress: Progress) -> dict[str, Any]:
    """Read `mesh.ply` and `attributes.json`, write `routes.json`.

    Returns
    -------
    Metrics: routes, holds in a route, holds without one, ambiguous holds, volumes.
    """
    from walltopo.formats.ply import read_mesh

    holds = read_holds(scan.attributes)
    metric = bool(read_json(scan.scale)["metric"]) if scan.scale.is_file() else True
    mesh = read_mesh(scan.mesh)
    routes, unrouted = find_routes(mesh, holds, settings, metric=metric, progress=progress)
    volumes = sorted(hold.id for hold in holds if hold.role == "volume")
    write_json(
        scan.routes,
        {
            "version": 1,
            "routes": [route.to_json() for route in routes],
            "unrouted": unrouted,
            "volumes": volumes,
        },
    )
    return {
        "routes": len(routes),
        "holds_in_routes": sum(len(route.holds) for route in routes),
        "unrouted": len(unrouted),
        "ambiguous": sum(len(route.ambiguous) for route in routes),
        "volumes": len(volumes),
    }
