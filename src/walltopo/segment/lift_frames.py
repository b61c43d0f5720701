"""Compare the rays of the views with the mesh: the unit and the axes of both may differ."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh, View
from walltopo.geometry.rays import Bvh
from walltopo.segment.lift.distance import mask_rays

Floats = NDArray[np.float64]

_UNITS = (1.0, 0.001, 1000.0, 0.01, 100.0, 0.0254, 1 / 0.0254, 0.3048, 1 / 0.3048)
_TURNS = ((0, 0), *((axis, angle) for angle in (90, -90, 180) for axis in range(3)))

_FITS = 0.8  # share of rays that meet one side of the mesh in a frame that fits
_CONTRADICTS = 0.5  # and in one that does not

_MAX_RAYS = 600
_SAME_PLACE = 0.04  # of the distance: rays of two photos of one object meet the mesh that close

# A photo of an object is taken from at most so many times the extent of all cameras.
_MAX_DISTANCE = 20.0


@dataclass(frozen=True)
class MeshChange:
    """A change of the mesh: first turned about an axis, then scaled.

    Parameters
    ----------
    factor : scale; axis : 0 to 2 for x to z; angle_deg : turn about the axis.
    """

    factor: float = 1.0
    axis: int = 0
    angle_deg: int = 0

    @property
    def rotation(self) -> Floats:
        """Return the (3, 3) rotation."""
        from scipy.spatial.transform import Rotation

        return np.asarray(
            Rotation.from_euler("xyz"[self.axis], self.angle_deg, degrees=True).as_matrix()
        )

    def describe(self) -> str:
        """Return the change in words."""
        words = []
        if self.angle_deg:
            words.append(f"turned by {self.angle_deg} degrees about {'xyz'[self.axis]}")
        if self.factor != 1:
            words.append(f"scaled by {self.factor:.4g}")
        return " and ".join(words)


def explain_frames(mesh: Mesh, views: Sequence[View], seed: int) -> str:
    """Return how the frames of mesh and cameras differ; empty if most masks meet its front.

    The text names the factor and the turn by which the rays through the masks meet the mesh, if
    one of the usual units and axes does so. Triangles of many meshes are inside out, so either side
    counts.
    """
    chosen = _overlapping_views(views)
    if not chosen:
        return ""
    origins, directions = mask_rays(chosen, seed, _MAX_RAYS)
    centres = np.array([view.centre for view in views])
    limit = _MAX_DISTANCE * float(np.linalg.norm(np.ptp(centres, axis=0)))
    rays = _Rays(mesh, origins, directions, limit or np.inf)
    front, back = rays.shares(MeshChange())
    if max(front, back) < _CONTRADICTS:
        best = max(_changes_to_try(), key=lambda change: max(rays.shares(change)))
        fits = max(rays.shares(best))
        if fits < _FITS:
            return ""
        return (
            f"{_percent(max(front, back))} of the rays through masks meet the mesh where those "
            f"of other photos do; if the mesh were {best.describe()}, {_percent(fits)} would"
        )
    if back > front:
        return (
            f"{_percent(back)} of the rays through masks meet the mesh from behind: its triangles "
            "are inside out, or the cameras are in another frame"
        )
    return ""


def _overlapping_views(views: Sequence[View]) -> list[View]:
    """Return consecutive views with about `_MAX_RAYS` masks, from the middle; they overlap."""
    masked = [view for view in views if any(mask.area for mask in view.masks)]
    chosen: list[View] = []
    for view in masked[len(masked) // 4 :] + masked[: len(masked) // 4]:
        if sum(len(one.masks) for one in chosen) >= _MAX_RAYS:
            break
        chosen.append(view)
    return chosen


def _percent(share: float) -> str:
    return f"{100 * share:.0f} %"


def _changes_to_try() -> Iterator[MeshChange]:
    """Yield the changes to try, simple ones first."""
    both = [(unit, turn) for unit in _UNITS for turn in _TURNS]
    both.sort(key=lambda pair: (pair[0] != 1) + (pair[1] != (0, 0)))
    for unit, (axis, angle) in both[1:]:
        yield MeshChange(unit, axis, angle)


class _Rays:
    """Rays through the masks, and the mesh that they meet."""

    def __init__(self, mesh: Mesh, origins: Floats, directions: Floats, limit: float) -> None:
        self.mesh, self.origins, self.directions, self.limit = mesh, origins, directions, limit
        self.tree = Bvh(mesh.vertices, mesh.faces)

    def shares(self, change: MeshChange) -> tuple[float, float]:
        """Return the shares of rays that meet the front and the back of the changed mesh.

        A hit counts within the limit, and where the ray of another photo meets the mesh, too.
        """
        # The rays are changed instead of the mesh, so that one tree serves all changes.
        back = change.rotation.T
        origins = self.origins @ back.T / change.factor
        directions = self.directions @ back.T
        face, distance = self.tree.first_hit(origins, directions)
        hit = face >= 0
        a, b, c = (self.mesh.vertices[self.mesh.faces[face[hit], k]] for k in range(3))
        distances = distance[hit] * change.factor
        places = self.origins[hit] + distances[:, None] * self.directions[hit]
        good = self._meet_again(places, self.origins[hit], distances) & (distances <= self.limit)
        facing = (np.cross(b - a, c - a) * directions[hit]).sum(axis=1) < 0
        return float((facing & good).sum() / len(face)), float((~facing & good).sum() / len(face))

    def _meet_again(self, places: Floats, eyes: Floats, distances: Floats) -> NDArray[np.bool_]:
        """Return (n,) whether a ray from another camera ends close to each place."""
        from scipy.spatial import cKDTree

        if not len(places):
            return np.zeros(0, dtype=np.bool_)
        near = cKDTree(places).query_ball_point(places, _SAME_PLACE * distances)
        return np.array(
            [bool((eyes[found] != eye).any()) for found, eye in zip(near, eyes, strict=True)]
        )
