"""A part of a wall: one route with the surface around it, or a stretch of the wall."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from walltopo.core import InputError
from walltopo.export.keep import keep_faces
from walltopo.export.parallel import front_direction
from walltopo.export.wall import Wall

__all__ = ["crop_route", "crop_section"]

AROUND = 0.8  # metres of wall kept around a route's holds


def crop_route(wall: Wall, route_id: int) -> Wall:
    """One route alone: its holds, the volumes near them, and the wall around.

    Raises
    ------
    InputError : there is no such route; names the ones there are.
    """
    from scipy.spatial import cKDTree

    route = next((r for r in wall.routes if r.id == route_id), None)
    if route is None:
        known = ", ".join(str(r.id) for r in wall.routes) or "none"
        raise InputError(f"no route {route_id} in this scan; there are {known}")
    members = set(route.holds)
    places = np.array([h.position for h in wall.holds if h.id in members], dtype=float)
    unit = 1.0 if wall.metric else float(np.ptp(wall.mesh.vertices[:, 2])) / 4.0
    distance, _ = cKDTree(places).query(wall.mesh.centroids, distance_upper_bound=AROUND * unit)
    keep = np.isfinite(distance) | np.isin(wall.face_instance, list(members))
    near = set(np.unique(wall.face_instance[keep]).tolist())
    volumes = {h.id for h in wall.holds if h.kind == "volume" and h.id in near}
    keep |= np.isin(wall.face_instance, list(volumes))
    cropped = keep_faces(wall, keep, members | volumes)
    only = [r for r in cropped.routes if r.id == route_id]
    return replace(cropped, routes=only)


def crop_section(wall: Wall, left: float, right: float) -> Wall:
    """The stretch between two distances from the wall's left end, as seen from the front.

    Raises
    ------
    InputError : the stretch is empty.
    """
    if not left < right:
        raise InputError(f"a section runs from left to right, got {left} to {right}")
    front = front_direction(wall.mesh)
    along = wall.mesh.centroids @ np.cross(-front, np.array([0.0, 0.0, 1.0]))
    along -= along.min()
    keep = (along >= left) & (along <= right)
    inside = np.unique(wall.face_instance[keep])
    # A hold on the border belongs to the section with most of it.
    shown = {int(i) for i in inside if i > 0 and keep[wall.face_instance == i].mean() >= 0.5}
    keep = (
        keep & ((wall.face_instance == 0) | np.isin(wall.face_instance, list(shown)))
    ) | np.isin(wall.face_instance, list(shown))
    return keep_faces(wall, keep, shown)
