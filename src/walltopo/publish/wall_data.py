"""What the export reads: mesh, labels, texture and the tables of one scan."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from pathlib import Path

import msgspec
import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError, Mesh, View
from walltopo.publish.wall_files import WallFiles
from walltopo.scans.artifacts import load_bundle
from walltopo.scans.folder import ScanFolder
from walltopo.scans.holds import HoldRow
from walltopo.scans.pictures import TextureUv
from walltopo.scans.routes import Route


@dataclass(frozen=True, eq=False)
class Wall:
    """One segmented wall.

    Parameters
    ----------
    mesh : the lifted mesh, world frame, z up.
    face_instance : (F,) int32, hold id of each triangle, 0 = wall.
    uv : (F, 3, 2) float32 in [0, 1], origin at the image's top left; None without a texture.
    texture : the atlas' file; None without a texture.
    holds, routes : the rows of `holds.json` and `routes.json`.
    metric : whether lengths are metres.
    title : the name that people see.
    views : the photos that it was made of, where they are known.
    """

    mesh: Mesh
    face_instance: NDArray[np.int32]
    uv: NDArray[np.float32] | None
    texture: Path | None
    holds: list[HoldRow]
    routes: list[Route]
    metric: bool
    title: str = "Wall"
    views: tuple[View, ...] = ()

    def __post_init__(self) -> None:
        count = len(self.mesh.faces)
        if self.face_instance.shape != (count,):
            raise InputError(
                f"instances: the mesh has {count} triangles, face_instance is "
                f"{self.face_instance.shape}",
                "mesh.ply and instances.npz are of different runs; run the scan again.",
            )
        if self.uv is not None:
            TextureUv(self.uv).check_fits(self.mesh)
        if (self.uv is None) != (self.texture is None):
            raise InputError("texture: texture.png and texture.npz must come together")


def wall_of(reads: WallFiles, title: str) -> Wall:
    """The wall of a scan.

    Raises
    ------
    InputError : its files are of different runs.
    """
    mesh = reads.mesh
    reads.instances.check_fits(mesh)
    labels = reads.instances.face_instance
    if reads.relabelled is not None:
        labels = reads.relabelled.on(labels)
    shown = np.isin(labels, [hold.id for hold in reads.holds.holds])
    return Wall(
        mesh=mesh,
        face_instance=np.where(shown, labels, 0).astype(np.int32),
        uv=reads.texture_uv.uv,
        texture=reads.texture.path,
        holds=list(reads.holds.holds),
        routes=list(reads.routes.routes),
        metric=reads.scale.metric,
        title=title,
        views=tuple(reads.sparse.views),
    )


def read_wall(scan: ScanFolder, title: str = "") -> Wall:
    """The wall of a finished scan.

    Raises
    ------
    InputError : a file is missing or does not fit the others; names it.
    """
    reads = load_bundle(scan, WallFiles)
    return wall_of(reads, title or scan.root.resolve().name)


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
