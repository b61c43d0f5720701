"""A wall with some of its faces."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

import msgspec
import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError, Mesh
from walltopo.export.wall import Wall

__all__ = ["keep_faces"]


def keep_faces(wall: Wall, keep: NDArray[np.bool_], shown: Collection[int]) -> Wall:
    """The wall with the faces of `keep` alone; of the holds, those in `shown` keep their id."""
    if not keep.any():
        raise InputError("nothing of the wall lies in the part that was asked for")
    faces = wall.mesh.faces[keep]
    met = np.zeros(len(wall.mesh.vertices), dtype=np.bool_)
    met[faces] = True
    used, number = np.flatnonzero(met), np.cumsum(met, dtype=np.int32) - 1
    colours = wall.mesh.vertex_colours
    mesh = Mesh(
        wall.mesh.vertices[used],
        number[faces].astype(np.int32),
        None if colours is None else colours[used],
        ~wall.mesh.measured[keep],
    )
    labels = wall.face_instance[keep]
    labels = np.where(np.isin(labels, list(shown)), labels, 0).astype(np.int32)
    holds = [hold for hold in wall.holds if hold.id in shown]
    routes = []
    for route in wall.routes:
        if any(hold in shown for hold in route.holds):
            lists = {
                name: tuple(h for h in getattr(route, name) if h in shown)
                for name in ("holds", "start", "top", "zone", "footholds")
            }
            routes.append(msgspec.structs.replace(route, **lists))
    uv = None if wall.uv is None else wall.uv[keep]
    return replace(wall, mesh=mesh, face_instance=labels, uv=uv, holds=holds, routes=routes)
