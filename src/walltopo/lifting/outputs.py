"""Results of the lift that people look at: a mesh with a colour per instance."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Instances, Mesh
from walltopo.core.files import atomic_path
from walltopo.meshes.ply import write_ply

__all__ = ["coloured_mesh", "instance_colours", "write_coloured"]

UNLABELLED = (150, 150, 150)


def instance_colours(count: int) -> NDArray[np.uint8]:
    """(count + 1, 3) sRGB colours, row 0 grey for no instance; neighbours in number differ."""
    import colorsys

    colours = [UNLABELLED]
    for number in range(count):
        # Steps of the golden ratio around the hue circle never come close to an earlier hue.
        hue = (number * 0.6180339887498949) % 1.0
        light = (0.45, 0.6, 0.35)[number % 3]
        red, green, blue = colorsys.hls_to_rgb(hue, light, 0.85)
        colours.append((round(255 * red), round(255 * green), round(255 * blue)))
    return np.array(colours, dtype=np.uint8)


def coloured_mesh(mesh: Mesh, instances: Instances) -> Mesh:
    """The mesh with sharp colours: vertices at a border are doubled, one for each side."""
    corner = mesh.faces.ravel().astype(np.int64)
    label = np.repeat(instances.face_instance.astype(np.int64), 3)
    key = corner * (int(label.max(initial=0)) + 1) + label
    _, first, inverse = np.unique(key, return_index=True, return_inverse=True)
    colours = instance_colours(int(label.max(initial=0)))
    return Mesh(
        mesh.vertices[corner[first]],
        inverse.reshape(-1, 3).astype(np.int32),
        colours[label[first]],
    )


def write_coloured(folder: Path, mesh: Mesh, instances: Instances) -> list[Path]:
    """Write `instances.ply` and `instances.glb` into a folder."""
    import trimesh

    coloured = coloured_mesh(mesh, instances)
    ply, glb = folder / "instances.ply", folder / "instances.glb"
    write_ply(ply, coloured)
    exported = trimesh.Trimesh(
        coloured.vertices, coloured.faces, vertex_colors=coloured.vertex_colours, process=False
    )
    with atomic_path(glb) as temporary:
        temporary.write_bytes(exported.export(file_type="glb"))
    return [ply, glb]
