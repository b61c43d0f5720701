"""Tuning of the lift by instance AP on labelled walls."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from walltopo.core import InputError, Mesh, View
from walltopo.geometry.mesh_files import read_mesh
from walltopo.scans.coco_import import read_coco_masks
from walltopo.scans.colmap_model import read_views
from walltopo.scans.folder import ScanFolder
from walltopo.segment.lift import LiftParams
from walltopo_lab.evaluate.align import align_views
from walltopo_lab.evaluate.carry import Carried, carry_truth, overlap_with_missing
from walltopo_lab.evaluate.instances import summarise_instances
from walltopo_lab.evaluate.overlap import Labelled, Overlap
from walltopo_lab.evaluate.scan import is_metric, scan_views
from walltopo_lab.evaluate.truth import Truth, read_truth
from walltopo_lab.tune.lifted import Lifted
from walltopo_lab.tune.task import Range
from walltopo_lab.tune.walls import Wall, scan_names

# The published ranges. The robust method has no easing and, with its own objective, no resolution;
# for it, those of its own settings that affect the result.
_PUBLISHED = (
    Range("visibility_distance", 2.0, 20.0, 8.0),
    Range("easing_power", -1.0, 1.0, 0.0),
    Range("threshold", 0.0, 1.0, 0.5),
    Range("resolution", 0.0, 100.0, 1.0, curve=3.0),
)
_ROBUST = {
    "visibility_distance": (2.0, 20.0),
    "threshold": (0.05, 0.95),
    "cohesion": (0.05, 0.9),
    "min_support": (0.0, 0.6),
    "border_band": (0.0, 12.0),
}
FIGURES = ("ap", "ap50", "ap25", "coco_ap")


@dataclass(frozen=True, eq=False)
class LiftWall:
    """A wall loaded for the lift: mesh, views and masks as input, and the ground truth."""

    name: str
    mesh: Mesh
    views: tuple[View, ...]
    truth: Truth
    carried: Carried
    normalised: bool = False

    def overlap(self, found: Labelled) -> Overlap:
        """Return the overlap of a lift's instances with the truth."""
        return overlap_with_missing(found, self.carried, self.mesh.areas, self.truth)


def load_lift_wall(wall: Wall, within: float = 0.02) -> LiftWall:
    """Read a wall's mesh, views, masks and truth; transfer the truth to the mesh within metres."""
    truth = read_truth(wall.truth)
    if wall.scan is not None:
        scan = ScanFolder(wall.scan)
        mesh, views = read_mesh(scan.mesh).without_guesses(), read_views(scan.sparse)
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


class LiftTask:
    """Instance AP (mean of the classes) as a function of the lift's settings.

    Visibility is computed once per wall. A trial repeats only the steps whose settings changed (see
    `Lifted`).

    Parameters
    ----------
    walls : loaded walls.
    method : literal or robust.
    figure : one of `FIGURES`, as the mean over classes.
    """

    def __init__(self, walls: Sequence[LiftWall], method: str, figure: str = "ap") -> None:
        if figure not in FIGURES:
            raise InputError(f"figure {figure!r}; expected one of {', '.join(FIGURES)}")
        self.section, self.figure = "lift", figure
        self.fixed: Mapping[str, Any] = {"method": method}
        defaults = LiftParams()
        self.ranges: Sequence[Range] = _PUBLISHED
        if method == "robust":
            self.ranges = tuple(
                Range(name, *bounds, getattr(defaults, name)) for name, bounds in _ROBUST.items()
            )
        highest = {r.name: r.high for r in self.ranges}
        far, wide = highest["visibility_distance"], highest.get("border_band", 0.0)
        self._names = scan_names([wall.name for wall in walls])
        self.walls = tuple(walls)
        self.lifted = tuple(Lifted(wall.mesh, wall.views, far, wide) for wall in walls)

    def params(self, wall: LiftWall, values: Mapping[str, float]) -> LiftParams:
        """Return the lift's settings with these values for one wall."""
        changed = {**self.fixed, **values, "normalised": wall.normalised}
        return replace(LiftParams(), **dict[str, Any](changed))

    def evaluate(self, values: Mapping[str, float]) -> dict[str, float]:
        """Return the metric on each wall."""
        result: dict[str, float] = {}
        for name, wall, lifted in zip(self._names, self.walls, self.lifted, strict=True):
            found = Labelled.of(lifted(self.params(wall, values)))
            metrics = summarise_instances([wall.overlap(found)])
            result[name] = float(getattr(metrics.mean, self.figure))
        return result
