"""Tuning the lift: instance AP on labelled walls."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError, Instances, Mesh, Silent, View
from walltopo.evaluate.align import align_views
from walltopo.evaluate.carry import Carried, carry_truth, overlap_with_missing
from walltopo.evaluate.instances import summarise_instances
from walltopo.evaluate.overlap import Labelled, Overlap
from walltopo.evaluate.scan import is_metric, scan_views
from walltopo.evaluate.truth import Truth, read_truth
from walltopo.formats.coco import read_coco_masks
from walltopo.formats.colmap import read_views
from walltopo.formats.ply import read_mesh
from walltopo.lift import LiftParams
from walltopo.tune.problem import Range
from walltopo.tune.walls import Wall
from walltopo.workspace import ScanFolder

__all__ = ["LiftProblem", "LiftWall", "load_lift_wall"]

Floats = NDArray[np.float64]

# The published ranges; for the robust method, whose clusters have no resolution, its own.
_PUBLISHED = (
    Range("visibility_distance", 2.0, 20.0, 8.0),
    Range("easing_power", -1.0, 1.0, 0.0),
    Range("threshold", 0.0, 1.0, 0.5),
    Range("resolution", 0.0, 100.0, 1.0, curve=3.0),
)
_ROBUST = ("visibility_distance", "easing_power", "threshold", "cohesion", "least_support")
_ROBUST_RANGES = {
    "visibility_distance": (2.0, 20.0),
    "easing_power": (-1.0, 1.0),
    "threshold": (0.05, 0.95),
    "cohesion": (0.05, 0.9),
    "least_support": (0.0, 0.6),
}
FIGURES = ("ap", "ap50", "ap25", "coco_ap")


@dataclass(frozen=True, eq=False)
class LiftWall:
    """A wall loaded for the lift: what goes in, and what should come out."""

    name: str
    mesh: Mesh
    views: tuple[View, ...]
    truth: Truth
    carried: Carried
    normalised: bool = False

    def overlap(self, instances: Instances) -> Overlap:
        """A lift's result against the truth."""
        return overlap_with_missing(
            Labelled.of(instances), self.carried, self.mesh.areas, self.truth
        )


def load_lift_wall(wall: Wall, within: float = 0.02) -> LiftWall:
    """Read a wall's mesh, views, masks and truth; truth is carried to the mesh within metres."""
    truth = read_truth(wall.truth)
    if wall.scan is not None:
        scan = ScanFolder(wall.scan)
        mesh, views = read_mesh(scan.mesh), read_views(scan.sparse)
        masks, _ = read_coco_masks(scan.detections)
        metric = is_metric(scan)
        transform = align_views(scan_views(scan, truth), truth.views, not metric)
        carried = carry_truth(truth, transform.mesh(mesh), within)
        normalised = not metric
    else:
        beside = wall.truth if wall.truth.is_dir() else wall.truth.parent
        beside = beside / "truth" if (beside / "truth/gt.npz").is_file() else beside
        mesh = read_mesh(wall.mesh) if wall.mesh else truth.mesh
        views = read_views(wall.cameras or beside / "cameras")
        masks, _ = read_coco_masks(wall.masks or beside / "masks.json")
        carried, normalised = carry_truth(truth, mesh, within), False
    posed = tuple(view.with_masks(masks.get(view.name, ())) for view in views)
    if not any(view.masks for view in posed):
        raise InputError(f"{wall.name}: none of its masks belongs to one of its cameras")
    return LiftWall(wall.name, mesh, posed, truth, carried, normalised)


class LiftProblem:
    """Instance AP (mean of the classes) as a function of the lift's settings.

    For the literal method the visibility of each wall is found once, at the largest distance:
    weights by distance follow from it, and neither threshold nor resolution changes it.

    Parameters
    ----------
    walls : loaded walls.
    method : literal or robust.
    figure : one of `FIGURES`; of the mean over classes.
    """

    def __init__(self, walls: Sequence[LiftWall], method: str, figure: str = "ap") -> None:
        if figure not in FIGURES:
            raise InputError(f"figure {figure!r}; expected one of {', '.join(FIGURES)}")
        self._walls, self._method, self.figure = walls, method, figure
        self._cached: dict[str, Any] = {}
        self.section = "lift"
        self.fixed: Mapping[str, Any] = {"method": method}
        defaults = LiftParams()
        self.ranges: Sequence[Range] = _PUBLISHED
        if method == "robust":
            self.ranges = tuple(
                Range(name, *_ROBUST_RANGES[name], getattr(defaults, name)) for name in _ROBUST
            )

    def evaluate(self, values: Mapping[str, float]) -> dict[str, float]:
        """The figure on each wall."""
        params = replace(LiftParams(), method=self._method, **dict[str, Any](values))
        result: dict[str, float] = {}
        for wall in self._walls:
            instances = self._lift(wall, replace(params, normalised=wall.normalised))
            metrics = summarise_instances([wall.overlap(instances)])
            result[wall.name] = float(getattr(metrics.mean, self.figure))
        return result

    def _lift(self, wall: LiftWall, params: LiftParams) -> Instances:
        from walltopo.lift.methods import run_method

        if self._method != "literal" or params.normalised:
            return run_method(wall.mesh, wall.views, params, Silent())
        return self._literal(wall, params)

    def _literal(self, wall: LiftWall, params: LiftParams) -> Instances:
        from walltopo.lift.cluster import louvain
        from walltopo.lift.fast import literal_clusters
        from walltopo.lift.merge import literal_instances, literal_labels
        from walltopo.tune.seen import SeenOnce

        if wall.name not in self._cached:
            farthest = next(r.high for r in self.ranges if r.name == "visibility_distance")
            self._cached[wall.name] = SeenOnce(wall.mesh, wall.views, farthest)
        seen: SeenOnce = self._cached[wall.name]
        evidence = seen.evidence(params.visibility_distance, params.easing_power)
        cluster = literal_clusters(evidence, params, louvain)
        kept, shares = literal_labels(evidence, cluster, params.threshold)
        return literal_instances(evidence, cluster, kept, shares, len(wall.mesh.faces))
