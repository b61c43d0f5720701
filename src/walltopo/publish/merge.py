"""Several aligned sections of a gym as one wall; newer surface replaces older where they overlap.

The scans must share a frame: the first is the reference of the others, or they have one
reference in common (`walltopo scan NEW --reference OLD`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError, Mesh, SettingsError
from walltopo.core.files import atomic_path
from walltopo.images.files import read_rgb
from walltopo.publish.wall_data import Wall, keep_faces
from walltopo.scans.holds import HoldRow
from walltopo.scans.routes import Route

Floats = NDArray[np.float64]
MOST_TEXTURE = 16384


def _covered(old: Wall, new: Wall, near: float) -> NDArray[np.bool_]:
    """Which old faces the new surface replaces: a new face of like direction lies near.

    A hold that was taken off stands out of the new wall; it goes where the wall behind or
    under it was scanned again, which the same distance test, longer for holds, finds.
    """
    from scipy.spatial import cKDTree

    tree = cKDTree(new.mesh.centroids)
    reach = np.where(old.face_instance > 0, 3 * near, near)
    distance, index = tree.query(old.mesh.centroids, distance_upper_bound=3 * near)
    found = np.isfinite(distance) & (distance <= reach)
    like = np.zeros(len(found), dtype=bool)
    chosen = np.flatnonzero(found)
    dots = (old.mesh.normals[chosen] * new.mesh.normals[index[chosen]]).sum(axis=1)
    # Holds bulge every way; a sheet of wall must face the same way as what replaces it.
    like[chosen] = (dots > 0.3) | (old.face_instance[chosen] > 0)
    return found & like


def _whole_holds(old: Wall, covered: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """A hold goes or stays as a whole, by the larger part of its faces."""
    most = int(old.face_instance.max(initial=0)) + 1
    total = np.bincount(old.face_instance, minlength=most)
    gone = np.bincount(old.face_instance, covered, minlength=most)
    replaced = gone > 0.5 * np.maximum(total, 1)
    is_hold = old.face_instance > 0
    return np.where(is_hold, replaced[old.face_instance], covered)


def join_textures(walls: Sequence[Wall], path: Path) -> list[Wall]:
    """The walls with their pictures put side by side into one atlas, written to `path` (PNG).

    Sections are laid out in a grid, so that the atlas stays near square; it is made smaller
    where it would pass 16,384 pixels. Walls come back as they are if any has no texture.
    """
    from PIL import Image

    if any(wall.texture is None or wall.uv is None for wall in walls):
        return [replace(wall, texture=None, uv=None) for wall in walls]
    pictures = [Image.fromarray(read_rgb(wall.texture)) for wall in walls if wall.texture]
    columns = math.ceil(math.sqrt(len(walls)))
    rows = math.ceil(len(walls) / columns)
    cell = np.array([max(p.width for p in pictures), max(p.height for p in pictures)])
    shrink = min(1.0, MOST_TEXTURE / float((cell * [columns, rows]).max()))
    side = np.maximum((cell * shrink).astype(int), 1)
    atlas = Image.new("RGB", (int(side[0]) * columns, int(side[1]) * rows), (128, 128, 128))
    grid = np.array([columns, rows])
    moved = []
    for number, (wall, picture) in enumerate(zip(walls, pictures, strict=True)):
        place = np.array([number % columns, number // columns])
        atlas.paste(picture.resize((int(side[0]), int(side[1]))), tuple((place * side).tolist()))
        assert wall.uv is not None
        uv = ((wall.uv + place) / grid).astype(np.float32)
        moved.append(replace(wall, uv=uv, texture=path))
    with atomic_path(path) as temporary:
        atlas.save(temporary, "PNG", compress_level=3)
    return moved


def _renumbered(wall: Wall, holds: int, routes: int) -> tuple[list[HoldRow], list[Route]]:
    """Rows with ids raised, so that no two sections share one."""
    shift = [
        msgspec.structs.replace(
            hold, id=hold.id + holds, route=None if hold.route is None else hold.route + routes
        )
        for hold in wall.holds
    ]
    moved = []
    for route in wall.routes:
        lists = {
            name: tuple(hold + holds for hold in getattr(route, name))
            for name in ("holds", "start", "top", "zone", "footholds")
        }
        moved.append(msgspec.structs.replace(route, id=route.id + routes, ambiguous=(), **lists))
    return shift, moved


def merge_walls(walls: Sequence[Wall], near: float = 0.03, title: str = "Gym") -> Wall:
    """One wall of several, oldest first; holds and routes get new ids in that order.

    Parameters
    ----------
    walls : at least two, in one frame; textured ones with `uv` in a joint atlas already
        (`join_textures`).
    near : metres within which a newer surface replaces an older one.

    Raises
    ------
    InputError : fewer than two, or some in metres and some not.
    SettingsError : `near` is not above 0, or not finite.
    """
    if not 0 < near < math.inf:
        raise SettingsError(f"near: expected a finite number of metres above 0, got {near}")
    if len(walls) < 2:
        raise InputError("merge needs two scans or more")
    if len({wall.metric for wall in walls}) > 1:
        raise InputError(
            "some of the scans are in metres and some are not; they cannot share a frame"
        )
    kept: list[Wall] = []
    for number, wall in enumerate(walls):
        keep = np.ones(len(wall.mesh.faces), dtype=bool)
        for newer in walls[number + 1 :]:
            keep &= ~_whole_holds(wall, _covered(wall, newer, near))
        if keep.any():
            shown = set(np.unique(wall.face_instance[keep]).tolist()) - {0}
            kept.append(keep_faces(wall, keep, shown))
    return _joined(kept, title)


def _joined(walls: Sequence[Wall], title: str) -> Wall:
    vertices, faces, labels, holds, routes = [], [], [], [], []
    first_vertex = first_hold = first_route = 0
    for wall in walls:
        vertices.append(wall.mesh.vertices)
        faces.append(wall.mesh.faces + first_vertex)
        ids = wall.face_instance
        labels.append(np.where(ids > 0, ids + first_hold, 0).astype(np.int32))
        rows, ways = _renumbered(wall, first_hold, first_route)
        holds += rows
        routes += ways
        first_vertex += len(wall.mesh.vertices)
        first_hold = max([first_hold, *(row.id for row in rows)])
        first_route = max([first_route, *(way.id for way in ways)])
    colours = [wall.mesh.vertex_colours for wall in walls]
    mesh = Mesh(
        np.vstack(vertices),
        np.vstack(faces).astype(np.int32),
        np.vstack([c for c in colours if c is not None])
        if all(c is not None for c in colours)
        else None,
        np.concatenate([~wall.mesh.measured for wall in walls]),
    )
    uv = [wall.uv for wall in walls]
    textured = all(part is not None for part in uv)
    return Wall(
        mesh=mesh,
        face_instance=np.concatenate(labels),
        uv=np.vstack([part for part in uv if part is not None]) if textured else None,
        texture=walls[0].texture if textured else None,
        holds=holds,
        routes=routes,
        metric=walls[0].metric,
        title=title,
    )
