"""Check a mesh for faults that the lift and the geodesics cannot handle."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh, View
from walltopo.geometry.graphs import duplicate_faces
from walltopo.geometry.topology import Edges, edge_lengths, edges_of, face_components, fans

# A component with fewer faces than this, and than this share of the mesh, is a fragment.
_FRAGMENT_FACES = 100
_FRAGMENT_SHARE = 1e-3
# A face with a height below this share of its longest side has no reliable normal.
_DEGENERATE = 1e-6
# Maximum share of the visible area that may face away from all cameras.
_INWARD_SHARE = 0.2


@dataclass(frozen=True)
class MeshReport:
    """The properties of a mesh; `defects` lists what is wrong with it.

    Lengths and areas are in the mesh's unit (metres in a scaled scan).
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
    def defects(self) -> list[str]:
        """Return one line per fault."""
        found = [
            (self.edges_of_many_faces, "edges with more than two faces (not manifold)"),
            (self.vertices_of_many_fans, "vertices where separate surfaces touch (not manifold)"),
            (self.flipped_edges, "edges whose two faces have opposite winding"),
            (self.degenerate_faces, "faces without area"),
            (self.doubled_faces, "faces that occur more than once"),
            (self.crumbs, f"fragments: components of fewer than {_FRAGMENT_FACES} faces"),
        ]
        lines = [f"{count} {fault}" for count, fault in found if count]
        if self.inward_share is not None and self.inward_share > _INWARD_SHARE:
            lines.append(
                f"normals point away from the cameras on {self.inward_share:.0%} of the area"
            )
        return lines

    def as_dict(self) -> dict[str, Any]:
        """Return the report and its defects as a JSON-serialisable dictionary."""
        return {**asdict(self), "problems": self.defects}


def check_mesh(mesh: Mesh, views: Sequence[View] = ()) -> MeshReport:
    """Examine a mesh and report its properties and faults.

    Parameters
    ----------
    mesh : any triangle mesh.
    views : cameras of the surface; they allow to check the direction of the normals.
    """
    edges = edges_of(mesh.faces)
    part = face_components(mesh.faces)
    sizes = np.bincount(part)
    crumb = (sizes < _FRAGMENT_FACES) & (sizes < _FRAGMENT_SHARE * len(mesh.faces))
    lengths = edge_lengths(mesh.vertices, edges)
    p05, median, p95 = np.percentile(lengths, [5, 50, 95]).tolist()
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
        flipped_edges=_count_flipped_edges(mesh, edges),
        degenerate_faces=int(degenerate(mesh).sum()),
        doubled_faces=int(duplicate_faces(mesh.faces).sum()),
        unused_vertices=int((fan_count == 0).sum()),
        doubled_vertices=_doubled_vertices(mesh),
        edge_length_median=median,
        edge_length_p05=p05,
        edge_length_p95=p95,
        inward_share=_inward_share(mesh, views) if views else None,
    )


def _doubled_vertices(mesh: Mesh) -> int:
    """Return the number of vertices that coincide exactly with another one."""
    x, y, z = mesh.vertices.T
    ordered = mesh.vertices[np.lexsort((z, y, x))]
    return int((ordered[1:] == ordered[:-1]).all(axis=1).sum())


def _fan_counts(mesh: Mesh, edges: Edges) -> NDArray[np.int64]:
    """Return (V,) the number of fans at each vertex; 0 for an unused vertex."""
    fan = fans(mesh.faces, edges).ravel()
    first = np.unique(fan, return_index=True)[1]
    return np.bincount(mesh.faces.ravel()[first], minlength=len(mesh.vertices))


def _count_flipped_edges(mesh: Mesh, edges: Edges) -> int:
    """Return the number of edges that both their faces traverse in the same direction."""
    forward = mesh.faces < np.roll(mesh.faces, -1, axis=1)
    forward_count = np.bincount(edges.of_face.ravel(), forward.ravel(), minlength=len(edges.count))
    return int(((edges.count == 2) & (forward_count != 1)).sum())


def degenerate(mesh: Mesh, min_flatness: float = _DEGENERATE) -> NDArray[np.bool_]:
    """Return (F,) whether a face's height is at most `min_flatness` of its longest side."""
    corners = mesh.vertices[mesh.faces]
    longest = np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2).max(axis=1)
    return np.asarray(2.0 * mesh.areas <= min_flatness * longest**2)


def _inward_share(mesh: Mesh, views: Sequence[View]) -> float:
    """Return the share of the area in photos' frames that faces away from all these cameras."""
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
