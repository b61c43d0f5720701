"""Tuning of the routes by the adjusted Rand index on labelled walls."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from walltopo.core import InputError, Mesh
from walltopo.core.parallel import available_cores
from walltopo.describe.routes.geodesic import pair_lengths
from walltopo.describe.routes.grouping import group_holds
from walltopo.describe.routes.proxy import PROXY_FACES, Proxy, build_proxy
from walltopo.describe.settings import RoutesSettings
from walltopo.geometry.mesh_files import read_mesh
from walltopo.scans.folder import ScanFolder
from walltopo.scans.holds import Hold, Holds
from walltopo_lab.evaluate.align import align_views
from walltopo_lab.evaluate.carry import carry_truth, overlap_with_missing
from walltopo_lab.evaluate.routes import grouping_scores, match_pairs
from walltopo_lab.evaluate.scan import is_metric, measured_labels, scan_views
from walltopo_lab.evaluate.truth import Truth, read_truth
from walltopo_lab.tune.task import Range
from walltopo_lab.tune.walls import Wall, scan_names


@dataclass(frozen=True, eq=False)
class RoutesWall:
    """A wall loaded for the routes.

    Parameters
    ----------
    points : (n, 3) float, hold positions, metres.
    colours : colour of each hold.
    routes : true route of each hold.
    proxy : the simplified wall mesh for geodesic paths, with the holds on it.
    """

    name: str
    points: np.ndarray[Any, np.dtype[np.float64]]
    colours: tuple[str, ...]
    routes: tuple[int, ...]
    proxy: Proxy


def load_routes_wall(wall: Wall) -> RoutesWall:
    """Read the holds of a wall: from its scan with measured colours, else from the ground truth."""
    truth = read_truth(wall.truth)
    if not truth.instances:
        raise InputError(f"{wall.truth}: has no scene.json, so its routes are unknown")
    if wall.scan is None:
        seen = set(np.unique(truth.face_instance[~truth.ignored]).tolist())
        true = [row for row in truth.instances.values() if row.route >= 0 and row.id in seen]
        points = np.array([row.position for row in true], dtype=np.float64)
        colours, routes = [row.colour for row in true], [row.route for row in true]
        mesh = _seen_mesh(truth)
    else:
        mesh, matched = _of_scan(ScanFolder(wall.scan), truth)
        points = np.array([hold.position for hold, _ in matched], dtype=np.float64)
        colours = [hold.colour for hold, _ in matched]
        routes = [truth.instances[t].route for _, t in matched]
    if len(points) < 2:
        raise InputError(f"{wall.name}: fewer than two holds with a known route")
    proxy = build_proxy(mesh.vertices, mesh.faces, points, PROXY_FACES)
    return RoutesWall(wall.name, points, tuple(colours), tuple(routes), proxy)


def _seen_mesh(truth: Truth) -> Mesh:
    """Return the true mesh without holds: paths run along the wall and its volumes."""
    labels = truth.labelled.labels
    holds = [number for number, label in labels.items() if label == 1]
    kept = ~np.isin(truth.face_instance, holds)
    return Mesh(truth.mesh.vertices, truth.mesh.faces[kept])


def _of_scan(scan: ScanFolder, truth: Truth) -> tuple[Mesh, list[tuple[Hold, int]]]:
    """Return the scan's mesh, and its holds with the routes of the true holds that they match."""
    whole = read_mesh(scan.mesh)
    mesh = whole.without_guesses()
    if not is_metric(scan):
        raise InputError(f"{scan.root}: not in metres; distances cannot be tuned on it")
    transform = align_views(scan_views(scan, truth), truth.views, similarity=False)
    carried = carry_truth(truth, transform.mesh(mesh), 0.02)
    predicted = measured_labels(scan, whole)
    pairs = match_pairs(overlap_with_missing(predicted, carried, mesh.areas, truth))
    return whole, [
        (hold, pairs[hold.id])
        for hold in Holds.load(scan.holds).holds
        if hold.role == "hold" and hold.id in pairs and truth.instances[pairs[hold.id]].route >= 0
    ]


class RoutesTask:
    """ARI as a function of the four route parameters, in the published ranges.

    The simplified wall is computed once per wall. Paths are measured per trial, because the ratio
    that flattens them changes which path is shortest.
    """

    def __init__(self, walls: Sequence[RoutesWall]) -> None:
        self._walls = walls
        self._names = scan_names([wall.name for wall in walls])
        self.section, self.figure = "routes", "ari"
        # Linking by paint has none of these parameters.
        self.fixed: Mapping[str, Any] = {"link": "colour"}
        now = RoutesSettings()
        self.ranges: Sequence[Range] = (
            Range("flatten_ratio", 0.0, 1.0, now.flatten_ratio),
            Range("resolution", 0.0, 100.0, now.resolution, curve=3.0),
            Range("min_hold_dist", 0.0, 5.0, now.min_hold_dist),
            Range("max_hold_dist", 0.0, 10.0, now.max_hold_dist),
        )

    def evaluate(self, values: Mapping[str, float]) -> dict[str, float]:
        """Return the ARI on each scan."""
        settings = replace(RoutesSettings(), **dict[str, Any](values))
        figures = [self._ari(wall, settings) for wall in self._walls]
        return dict(zip(self._names, figures, strict=True))

    def _ari(self, wall: RoutesWall, settings: RoutesSettings) -> float:
        threads = settings.threads or available_cores()
        grouping = group_holds(
            wall.points,
            wall.colours,
            lambda pairs: pair_lengths(
                wall.proxy, pairs, settings.flatten_ratio, settings.bridge_gap, threads
            ),
            near=settings.min_hold_dist,
            far=settings.max_hold_dist,
            ratio=settings.flatten_ratio,
            resolution=settings.resolution,
            seed=settings.seed,
        )
        return grouping_scores(wall.routes, grouping.group.tolist())["ari"]
