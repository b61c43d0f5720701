"""What is wrong with a mesh: the questions that the lift and the geodesics depend on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh, View
from walltopo.geometry.neighbours import parts
from walltopo.geometry.topology import Edges, doubled, edges_of, fans

# A part with fewer faces than this, and than this share of the mesh, is a crumb.
_CRUMB_FACES = 100
_CRUMB_SHARE = 1e-3
# A face whose height is below this share of its longest side has no usable normal.
_DEGENERATE = 1e-6
# Share of the seen area that may face away from every camera before normals count as inward.
_INWARD_SHARE = 0.2


@dataclass(frozen=True)
class MeshReport:
    """Facts about a mesh; `problems` says which of them must not be.

    Lengths and areas are in the mesh's own unit (metres once a scan is scaled).
    """

    vertices: int
    faces: int
    area: float
    parts: int
    crumbs: int
    border_edges: int
    edges_of_many_faces: int
    vertices_of_many_fans: int
    flipped_edges: int
    degenerate_faces: int
    doubled_faces: int
    unused_vertices: int
    doubled_vertices: int
    edge_length_median: float
    edge_length_p05: float
    edge_length_p95: float
    inward_share: float | None = None

    @property
    def problems(self) -> list[str]:
        """One line per fault, with what to do about it where that is not plain."""
        found = [
            (self.edges_of_many_faces, "edges with more than two faces (not manifold)"),
            (self.vertices_of_many_fans, "vertices where separate surfaces touch (not manifold)"),
            (self.flipped_edges, "edges whose two faces are wound against each other"),
            (self.degenerate_faces, "faces without area"),
            (self.doubled_faces, "faces that occur more than once"),
            (self.crumbs, f"loose parts of fewer than {_CRUMB_FACES} faces (crumbs)"),
        ]
        lines = [f"{count} {what}" for count, what in found if count]
        if self.inward_share is not None and self.inward_share > _INWARD_SHARE:
            lines.append(f"normals point away from the cameras on {self.inward_share:.0%} of it")
        return lines

    def as_dict(self) -> dict[str, Any]:
        """JSON-able, with the problems."""
        return {**asdict(self), "problems": self.problems}


def check_mesh(mesh: Mesh, views: Sequence[View] = ()) -> MeshReport:
    """Examine a mesh.

    Parameters
    ----------
    mesh : any triangle mesh.
    views : cameras that saw the surface; with them the direction of the normals is checked.
    """
    edges = edges_of(mesh.faces)
    part = parts(mesh.faces)
    sizes = np.bincount(part)
    crumb = (sizes < _CRUMB_FACES) & (sizes < _CRUMB_SHARE * len(mesh.faces))
    ends = mesh.vertices[edges.pairs]
    length = np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1)
    p05, median, p95 = np.percentile(length, [5, 50, 95]).tolist()
    fan_count = _fan_counts(mesh, edges)
    return MeshReport(
        vertices=len(mesh.vertices),
        faces=len(mesh.faces),
        area=float(mesh.areas.sum()),
        parts=len(sizes),
        crumbs=int(crumb.sum()),
        border_edges=int((edges.count == 1).sum()),
        edges_of_many_faces=int((edges.count > 2).sum()),
        vertices_of_many_fans=int((fan_count > 1).sum()),
        flipped_edges=_flipped(mesh, edges),
        degenerate_faces=int(degenerate(mesh).sum()),
        doubled_faces=int(doubled(mesh.faces).sum()),
        unused_vertices=int((fan_count == 0).sum()),
        doubled_vertices=_doubled_vertices(mesh),
        edge_length_median=median,
        edge_length_p05=p05,
        edge_length_p95=p95,
        inward_share=_inward(mesh, views) if views else None,
    )


def _doubled_vertices(mesh: Mesh) -> int:
    """Vertices at exactly the place of another one."""
    x, y, z = mesh.vertices.T
    ordered = mesh.vertices[np.lexsort((z, y, x))]
    return int((ordered[1:] == ordered[:-1]).all(axis=1).sum())


def _fan_counts(mesh: Mesh, edges: Edges) -> NDArray[np.int64]:
    """(V,) number of fans at each vertex; 0 = no face uses it."""
    fan = fans(mesh.faces, edges).ravel()
    first = np.unique(fan, return_index=True)[1]
    return np.bincount(mesh.faces.ravel()[first], minlength=len(mesh.vertices))


def _flipped(mesh: Mesh, edges: Edges) -> int:
    """Edges that both their faces walk in the same direction."""
    forward = mesh.faces < np.roll(mesh.faces, -1, axis=1)
    walks = np.bincount(edges.of_face.ravel(), forward.ravel(), minlength=len(edges.count))
    return int(((edges.count == 2) & (walks != 1)).sum())


def degenerate(mesh: Mesh, least: float = _DEGENERATE) -> NDArray[np.bool_]:
    """(F,) whether a face's height is at most this share of its longest side."""
    corners = mesh.vertices[mesh.faces]
    longest = np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2).max(axis=1)
    return np.asarray(2.0 * mesh.areas <= least * longest**2)


def _inward(mesh: Mesh, views: Sequence[View]) -> float:
    """Share of the area in some photo's frame that faces away from each such camera."""
    towards = np.zeros(len(mesh.faces), dtype=np.bool_)
    framed = np.zeros(len(mesh.faces), dtype=np.bool_)
    for view in views:
        pixels = view.project(mesh.centroids)
        size = np.array([view.camera.width, view.camera.height])
        inside = ((pixels >= 0) & (pixels < size)).all(axis=1)
        facing = ((view.centre - mesh.centroids) * mesh.normals).sum(axis=1) > 0
        framed |= inside
        towards |= inside & facing
    area = float(mesh.areas[framed].sum())
    return float(mesh.areas[framed & ~towards].sum()) / area if area > 0 else 0.0
