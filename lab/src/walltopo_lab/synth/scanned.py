"""The user's scanned holds as a replacement for procedural ones."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from walltopo.core import InputError, Mesh
from walltopo.geometry.mesh_files import read_mesh
from walltopo_lab.synth.bodies import Body
from walltopo_lab.synth.holds import HOLD_KINDS, SIZES, vertex_normals
from walltopo_lab.synth.setter import MakeHold

_SUFFIXES = {".obj", ".glb", ".gltf", ".ply", ".stl"}


def _kind_of(path: Path, mesh: Mesh) -> str:
    """Return the type in the file's name (`jug_03.obj`), else the type of nearest size."""
    for kind in HOLD_KINDS:
        if path.stem.lower().startswith(kind):
            return kind
    extent = np.ptp(mesh.vertices, axis=0)
    return min(
        HOLD_KINDS, key=lambda k: float(np.abs(np.log(extent / np.array(SIZES[k][:3]))).sum())
    )


def read_hold(path: Path) -> tuple[str, Body]:
    """Return (type, body) of one scanned hold.

    The file's frame is the hold's: x to the right, y up the wall, z out of the wall. Units are
    metres; a mesh larger than 1.5 is read as millimetres. The function centres the hold and puts
    its back on the wall.

    Raises
    ------
    InputError : no triangles, or an implausible size.
    """
    mesh = read_mesh(path)
    points = mesh.vertices.copy()
    extent = np.ptp(points, axis=0)
    if extent.max() > 1.5:
        points *= 0.001
        extent = extent * 0.001
    if not 0.015 < extent.max() < 1.5 or extent.min() <= 0.002:
        raise InputError(
            f"{path}: {extent[0]:.3f} x {extent[1]:.3f} x {extent[2]:.3f} m "
            "is not the size of a hold",
            "Scale the mesh to metres or millimetres, z out of the wall.",
        )
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    points -= [middle[0], middle[1], points[:, 2].min() + 0.002]
    normals = vertex_normals(points, mesh.faces)
    upward = np.clip(normals[:, 1] * 0.8 + normals[:, 2] * 0.35, 0, 1).astype(np.float32)
    blank = np.zeros(len(points), np.float32)
    reach = float(np.abs(points[:, :2]).max())
    body = Body(points, mesh.faces, normals, upward, blank, blank, reach)
    return _kind_of(path, Mesh(points, mesh.faces)), body


def scanned_holds(folder: Path) -> MakeHold:
    """Return a source of holds for `make_gym` that draws from the meshes of a folder.

    A type without a scan uses the scanned type of nearest size.

    Raises
    ------
    InputError : the folder contains no mesh, or an unusable one.
    """
    paths = sorted(p for p in Path(folder).rglob("*") if p.suffix.lower() in _SUFFIXES)
    if not paths:
        raise InputError(f"{folder}: no scanned holds here ({', '.join(sorted(_SUFFIXES))})")
    by_kind: dict[str, list[Body]] = {}
    for path in paths:
        kind, body = read_hold(path)
        by_kind.setdefault(kind, []).append(body)

    def make(kind: str, style: str, rng: np.random.Generator, scale: float) -> Body:
        size = np.array(SIZES[kind][:3])
        nearest = min(
            by_kind, key=lambda k: float(np.abs(np.log(np.array(SIZES[k][:3]) / size)).sum())
        )
        bodies = by_kind[nearest]
        body = bodies[int(rng.integers(len(bodies)))]
        if scale == 1.0:
            return body
        return Body(
            body.vertices * scale,
            body.faces,
            body.normals,
            body.chalk,
            body.gloss,
            body.steel,
            body.radius * scale,
        )

    return make
