"""The wall that the export writes: mesh, labels, texture and the tables of one scan."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from pathlib import Path

import msgspec
import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError, Mesh, View
from walltopo.geometry.topology import part_of_mesh
from walltopo.images.files import read_rgb
from walltopo.publish.hidden_texture import hide_in_texture
from walltopo.publish.wall_files import WallFiles
from walltopo.scans.artifacts import load_bundle
from walltopo.scans.folder import ScanFolder
from walltopo.scans.hidden import HiddenPlace
from walltopo.scans.holds import Hold
from walltopo.scans.pictures import TextureUv
from walltopo.scans.routes import Route


@dataclass(frozen=True, eq=False)
class WallModel:
    """A segmented wall.

    Parameters
    ----------
    mesh : the lifted mesh, world frame, z up.
    face_instance : (F,) int32, hold id of each triangle, 0 = wall.
    patches : (F,) int32, instance of each triangle before edits, 0 = wall; None: `face_instance`.
    uv : (F, 3, 2) float32 in [0, 1], origin at the image's top left; None without a texture.
    texture : file of the atlas; None without a texture. Read it by `read_texture`.
    hidden : places that are hidden in the texture.
    holds, routes : the rows of `holds.json` and `routes.json`.
    metric : whether lengths are metres.
    title : the name that people see.
    views : the photos of the wall, if known.
    """

    mesh: Mesh
    face_instance: NDArray[np.int32]
    uv: NDArray[np.float32] | None
    texture: Path | None
    holds: list[Hold]
    routes: list[Route]
    metric: bool
    title: str = "Wall"
    views: tuple[View, ...] = ()
    patches: NDArray[np.int32] | None = None
    hidden: tuple[HiddenPlace, ...] = ()

    def __post_init__(self) -> None:
        count = len(self.mesh.faces)
        if self.face_instance.shape != (count,):
            raise InputError(
                f"instances: the mesh has {count} triangles, face_instance is "
                f"{self.face_instance.shape}",
                "mesh.ply and instances.npz are from different runs; run the scan again.",
            )
        if self.uv is not None:
            TextureUv(self.uv).check_fits(self.mesh)
        if (self.uv is None) != (self.texture is None):
            raise InputError("texture: texture.png and texture.npz must come together")

    def read_texture(self) -> NDArray[np.uint8] | None:
        """Return the (H, W, 3) sRGB atlas without hidden places; None without a texture.

        Raises
        ------
        InputError : the file is unreadable.
        """
        if self.texture is None or self.uv is None:
            return None
        picture = read_rgb(self.texture)
        return hide_in_texture(picture, self.mesh, self.uv, self.hidden) if self.hidden else picture


def wall_model(reads: WallFiles, title: str) -> WallModel:
    """Return the wall of a scan.

    Raises
    ------
    InputError : the files are from different runs.
    """
    mesh = reads.mesh
    reads.instances.check_fits(mesh)
    labels = reads.instances.edited_labels(reads.relabelled)
    shown = np.isin(labels, [hold.id for hold in reads.holds.holds])
    return WallModel(
        mesh=mesh,
        face_instance=np.where(shown, labels, 0).astype(np.int32),
        uv=reads.texture_uv.uv,
        texture=reads.texture.path,
        holds=list(reads.holds.holds),
        routes=list(reads.routes.routes),
        metric=reads.scale.metric,
        title=title,
        views=tuple(reads.sparse.views),
        patches=reads.instances.face_instance,
        hidden=() if reads.hidden is None else reads.hidden.places,
    )


def read_wall(scan: ScanFolder, title: str = "") -> WallModel:
    """Return the wall of a finished scan.

    Raises
    ------
    InputError : a file is missing or does not match the others (the message names it).
    """
    reads = load_bundle(scan, WallFiles)
    return wall_model(reads, title or scan.root.resolve().name)


def keep_faces(wall: WallModel, keep: NDArray[np.bool_], shown: Collection[int]) -> WallModel:
    """Return the wall with only the faces in `keep`, and the holds in `shown` with their ids."""
    if not keep.any():
        raise InputError("no part of the wall lies in the requested part")
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
    return replace(
        wall,
        mesh=part_of_mesh(wall.mesh, keep),
        face_instance=labels,
        uv=uv,
        holds=holds,
        routes=routes,
        patches=None if wall.patches is None else wall.patches[keep],
    )
