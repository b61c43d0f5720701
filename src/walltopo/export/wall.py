"""What the export reads: mesh, labels, texture and the tables of one scan."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError, Mesh
from walltopo.scans.folder import ScanFolder
from walltopo.core.files import read_json

__all__ = ["Wall", "hold_table", "read_wall"]

CLASS_NAMES = {1: "hold", 2: "volume"}


@dataclass(frozen=True, eq=False)
class Wall:
    """One segmented wall.

    Parameters
    ----------
    mesh : the lifted mesh, world frame, z up.
    face_instance : (F,) int32, hold id of each triangle, 0 = wall.
    uv : (F, 3, 2) float32 in [0, 1], origin at the image's top left; None without a texture.
    texture : the atlas' file; None without a texture.
    holds : rows of `holds.json`.
    routes : rows of `routes.json`.
    metric : whether lengths are metres.
    title : the name that people see.
    """

    mesh: Mesh
    face_instance: NDArray[np.int32]
    uv: NDArray[np.float32] | None
    texture: Path | None
    holds: list[dict[str, Any]]
    routes: list[dict[str, Any]]
    metric: bool
    title: str = "Wall"

    def __post_init__(self) -> None:
        count = len(self.mesh.faces)
        if self.face_instance.shape != (count,):
            raise InputError(
                f"instances: the mesh has {count} triangles, face_instance is "
                f"{self.face_instance.shape}",
                "mesh.ply and instances.npz are of different runs; run the scan again.",
            )
        if self.uv is not None and self.uv.shape != (count, 3, 2):
            raise InputError(
                f"texture: the mesh has {count} triangles, uv is {self.uv.shape}",
                "mesh.ply and texture.npz are of different runs; run the scan again.",
            )
        if (self.uv is None) != (self.texture is None):
            raise InputError("texture: texture.png and texture.npz must come together")


def hold_table(
    attributes: list[dict[str, Any]],
    scores: dict[int, float],
    routes: list[dict[str, Any]],
) -> list[dict[str, Any]]:
    """The rows of `holds.json`: what `classify` found, its score and its route.

    Parameters
    ----------
    attributes : the instances of `attributes.json`.
    scores : instance id to its score in [0, 1].
    routes : the routes of `routes.json`; a hold on two routes is listed under the first.
    """
    route_of: dict[int, int] = {}
    for route in routes:
        for hold in route["holds"]:
            route_of.setdefault(int(hold), int(route["id"]))
    copied = ("id", "class", "type", "colour", "colour_rgb", "position", "normal")
    measured = ("size_m", "area_m2", "steepness_deg", "photos")
    rows = []
    for item in attributes:
        row = {key: item.get(key) for key in (*copied, *measured)}
        row["score"] = round(float(scores.get(int(item["id"]), 0.0)), 4)
        row["route"] = route_of.get(int(item["id"]))
        row["review"] = bool(item.get("review", False))
        row["role"] = item.get("role", item.get("class", "hold"))
        rows.append(row)
    return sorted(rows, key=lambda row: int(row["id"]))


def _read_labels(scan: ScanFolder, faces: int) -> NDArray[np.int32]:
    if not scan.instances.is_file():
        raise InputError(
            f"{scan.instances}: no such file", "Run the lift stage first (`walltopo scan`)."
        )
    with np.load(scan.instances) as data:
        labels = np.asarray(data["face_instance"], dtype=np.int32)
    if labels.shape != (faces,):
        raise InputError(
            f"{scan.instances}: holds labels of {labels.shape[0]} triangles, {scan.mesh.name} has "
            f"{faces}",
            "They are of different runs; run the scan again with --from lift.",
        )
    return labels


def _corrected(
    scan: ScanFolder,
    mesh: Mesh,
    labels: NDArray[np.int32],
    lifted: Collection[int],
    kept: list[int],
) -> NDArray[np.int32]:
    """The labels after a setter's strokes, without the holds that were deleted.

    Strokes of holds that were deleted afterwards count too, as in `routes.classify`: they took
    triangles from other holds before they went.
    """
    from walltopo.scans.edits import apply_strokes, read_hold_edits

    strokes = read_hold_edits(scan.hold_edits)["strokes"]
    known = [stroke for stroke in strokes if stroke["hold"] == 0 or stroke["hold"] in lifted]
    painted = apply_strokes(mesh, labels, known)
    return np.where(np.isin(painted, kept), painted, 0).astype(np.int32)


def read_wall(scan: ScanFolder, title: str = "") -> Wall:
    """Read what the export needs from a scan folder.

    Raises
    ------
    InputError : a file is missing or does not fit the mesh; names it.
    """
    from walltopo.meshes.ply import read_mesh

    mesh = read_mesh(scan.mesh)
    attributes = read_json(scan.attributes)["instances"]
    routes = read_json(scan.routes)["routes"]
    records = read_json(scan.instance_records)["instances"]
    scores = {int(item["id"]): float(item["score"]) for item in records}
    kept = [int(item["id"]) for item in attributes]
    labels = _corrected(scan, mesh, _read_labels(scan, len(mesh.faces)), scores, kept)
    metric = bool(read_json(scan.scale)["metric"]) if scan.scale.is_file() else False
    textured = scan.texture.is_file() and scan.texture_uv.is_file()
    uv = None
    if textured:
        with np.load(scan.texture_uv) as data:
            uv = np.asarray(data["uv"], dtype=np.float32)
    return Wall(
        mesh=mesh,
        face_instance=labels,
        uv=uv,
        texture=scan.texture if textured else None,
        holds=hold_table(attributes, scores, routes),
        routes=routes,
        metric=metric,
        title=title or scan.root.resolve().name,
    )
