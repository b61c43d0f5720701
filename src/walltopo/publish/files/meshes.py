"""Write OBJ with texture, PLY with hold ids, and PLY with one colour per hold."""

from __future__ import annotations

import colorsys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core.files import atomic_path, write_json
from walltopo.geometry.mesh_files import write_ply
from walltopo.publish.surface import Surface, split_at_borders
from walltopo.publish.texture_image import encode_picture, texels
from walltopo.publish.wall_data import WallModel

WALL_GREY = (160, 160, 160)


def instance_colours(ids: list[int]) -> dict[int, tuple[int, int, int]]:
    """Return a distinct colour for each id; the wall (0) is grey, which no hold gets."""
    colours: dict[int, tuple[int, int, int]] = {0: WALL_GREY}
    used = {WALL_GREY}
    for id_ in sorted(set(ids) - {0}):
        step = id_
        while True:
            # Steps of the golden ratio keep neighbouring ids far apart in hue.
            hue = (step * 0.6180339887) % 1.0
            shade = 0.95 - 0.2 * ((step // 7) % 3)
            red, green, blue = colorsys.hsv_to_rgb(hue, 0.55 + 0.4 * ((step // 21) % 2), shade)
            colour = (round(255 * red), round(255 * green), round(255 * blue))
            if colour not in used:
                break
            step += 1000
        used.add(colour)
        colours[id_] = colour
    return colours


def write_painted_ply(path: Path, wall: WallModel) -> None:
    """Paint each hold in its own colour; `<name>.colours.json` maps the colours to holds."""
    surface = split_at_borders(wall.mesh, wall.face_instance)
    ids = np.unique(surface.feature).tolist()
    colours = instance_colours(ids)
    paint = np.array([colours[i] for i in ids], dtype=np.uint8)
    vertex = paint[np.searchsorted(ids, surface.feature)]
    write_ply(path, replace(surface.mesh, vertex_colours=vertex))
    listing = [{"id": i, "rgb": list(colours[i])} for i in ids]
    write_json(path.with_suffix(".colours.json"), {"version": 1, "wall": 0, "colours": listing})


def _vertex_colours(wall: WallModel) -> NDArray[np.uint8] | None:
    """Return the (V, 3) colours of the vertices, from the texture if the wall has one."""
    picture = wall.read_texture()
    if picture is None or wall.uv is None:
        return wall.mesh.vertex_colours
    result = np.full(wall.mesh.vertices.shape, 128, dtype=np.uint8)
    result[wall.mesh.faces.ravel()] = texels(picture, wall.uv.reshape(-1, 2))
    return result


def write_labelled_ply(path: Path, wall: WallModel) -> None:
    """Write binary PLY: vertex colours, and per face its hold id as the property `instance`."""
    write_ply(path, replace(wall.mesh, vertex_colours=_vertex_colours(wall)), wall.face_instance)


def _obj_faces(surface: Surface, rows: NDArray[np.int64]) -> str:
    one = surface.triangles[rows].astype(np.int64) + 1
    if surface.uv is None:
        return "".join(f"f {a} {b} {c}\n" for a, b, c in one.tolist())
    return "".join(f"f {a}/{a} {b}/{b} {c}/{c}\n" for a, b, c in one.tolist())


def write_obj(path: Path, wall: WallModel, quality: int = 90) -> None:
    """Write OBJ with one group per hold (`hold_12`, else `wall`), with MTL and JPEG texture.

    Coordinates stay metres with z up.
    """
    surface = split_at_borders(wall.mesh, wall.face_instance, wall.uv)
    label = surface.feature[surface.triangles[:, 0]]
    lines: list[str] = ["# walltopo, metres, z up\n"]
    picture = wall.read_texture()
    if picture is not None:
        data, _ = encode_picture(picture, 8192, "JPEG", quality)
        with atomic_path(path.with_suffix(".jpg")) as temporary:
            temporary.write_bytes(data)
        material = f"newmtl wall\nKd 1 1 1\nmap_Kd {path.stem}.jpg\n"
        with atomic_path(path.with_suffix(".mtl")) as temporary:
            temporary.write_text(material, encoding="utf-8")
        lines.append(f"mtllib {path.stem}.mtl\nusemtl wall\n")
    colours: Any = [None] * len(surface.positions)
    if surface.colours is not None:
        colours = (surface.colours / 255.0).tolist()
    for (x, y, z), rgb in zip(surface.positions.tolist(), colours, strict=True):
        tail = "" if rgb is None else " {:.4f} {:.4f} {:.4f}".format(*rgb)
        lines.append(f"v {x:.5f} {y:.5f} {z:.5f}{tail}\n")
    if surface.uv is not None:
        # OBJ has v = 0 at the bottom.
        lines += [f"vt {u:.6f} {1 - v:.6f}\n" for u, v in surface.uv.tolist()]
    for id_ in np.unique(label).tolist():
        lines.append(f"g hold_{id_}\n" if id_ else "g wall\n")
        lines.append(_obj_faces(surface, np.flatnonzero(label == id_)))
    with atomic_path(path) as temporary:
        temporary.write_text("".join(lines), encoding="utf-8")
