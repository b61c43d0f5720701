"""Merge several aligned sections of a gym into one wall; newer surface replaces older surface.

The scans must share a frame: the first is the reference of the others, or all have a common
reference (`walltopo scan NEW --reference OLD`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError, SettingsError
from walltopo.core.files import atomic_path
from walltopo.geometry.topology import joined_meshes
from walltopo.publish.wall_data import WallModel, keep_faces
from walltopo.scans.holds import Hold
from walltopo.scans.routes import Route

Floats = NDArray[np.float64]
MAX_TEXTURE = 16384


def _covered_faces(old: WallModel, new: WallModel, near: float) -> NDArray[np.bool_]:
    """Return which old faces the new surface replaces: a new face with a similar normal is near.

    A removed hold protrudes from the new wall. It is replaced if the wall behind or under it was
    scanned again, which the same test finds with a larger distance.
    """
    from scipy.spatial import cKDTree

    tree = cKDTree(new.mesh.centroids)
    reach = np.where(old.face_instance > 0, 3 * near, near)
    distance, index = tree.query(old.mesh.centroids, distance_upper_bound=3 * near)
    found = np.isfinite(distance) & (distance <= reach)
    similar = np.zeros(len(found), dtype=bool)
    chosen = np.flatnonzero(found)
    dots = (old.mesh.normals[chosen] * new.mesh.normals[index[chosen]]).sum(axis=1)
    # Holds have normals in all directions; only wall must face the same way as its replacement.
    similar[chosen] = (dots > 0.3) | (old.face_instance[chosen] > 0)
    return found & similar


def _whole_holds(old: WallModel, covered: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the covered faces, with each hold replaced or kept as a whole, by its larger part."""
    count = int(old.face_instance.max(initial=0)) + 1
    total = np.bincount(old.face_instance, minlength=count)
    gone = np.bincount(old.face_instance, covered, minlength=count)
    replaced = gone > 0.5 * np.maximum(total, 1)
    is_hold = old.face_instance > 0
    return np.where(is_hold, replaced[old.face_instance], covered)


def join_textures(walls: Sequence[WallModel], path: Path) -> list[WallModel]:
    """Return the walls with their pictures joined into one atlas, written to `path` (PNG).

    Sections form a grid, so that the atlas is nearly square. The atlas is scaled down if it would
    exceed 16,384 pixels. If any wall has no texture, all are returned without one.
    """
    from PIL import Image

    if any(wall.texture is None or wall.uv is None for wall in walls):
        return [replace(wall, texture=None, uv=None) for wall in walls]
    read = (wall.read_texture() for wall in walls)
    pictures = [Image.fromarray(picture) for picture in read if picture is not None]
    columns = math.ceil(math.sqrt(len(walls)))
    rows = math.ceil(len(walls) / columns)
    cell = np.array([max(p.width for p in pictures), max(p.height for p in pictures)])
    shrink = min(1.0, MAX_TEXTURE / float((cell * [columns, rows]).max()))
    side = np.maximum((cell * shrink).astype(int), 1)
    atlas = Image.new("RGB", (int(side[0]) * columns, int(side[1]) * rows), (128, 128, 128))
    grid = np.array([columns, rows])
    moved = []
    for number, (wall, picture) in enumerate(zip(walls, pictures, strict=True)):
        place = np.array([number % columns, number // columns])
        atlas.paste(picture.resize((int(side[0]), int(side[1]))), tuple((place * side).tolist()))
        assert wall.uv is not None
        uv = ((wall.uv + place) / grid).astype(np.float32)
        moved.append(replace(wall, uv=uv, texture=path, hidden=()))
    with atomic_path(path) as temporary:
        atlas.save(temporary, "PNG", compress_level=3)
    return moved


def _renumber_rows(wall: WallModel, holds: int, routes: int) -> tuple[list[Hold], list[Route]]:
    """Return rows with ids shifted, so that no two sections share one."""
    shifted_holds = [
        msgspec.structs.replace(
            hold, id=hold.id + holds, route=None if hold.route is None else hold.route + routes
        )
        for hold in wall.holds
    ]
    shifted_routes = []
    for route in wall.routes:
        lists = {
            name: tuple(hold + holds for hold in getattr(route, name))
            for name in ("holds", "start", "top", "zone", "footholds")
        }
        renumbered = msgspec.structs.replace(route, id=route.id + routes, ambiguous=(), **lists)
        shifted_routes.append(renumbered)
    return shifted_holds, shifted_routes


def merge_walls(walls: Sequence[WallModel], near: float = 0.03, title: str = "Gym") -> WallModel:
    """Return one wall from several, oldest first; holds and routes get new ids in that order.

    Parameters
    ----------
    walls : at least two, in one frame; textured ones with `uv` in a joint atlas already
        (`join_textures`).
    near : metres within which a newer surface replaces an older one.

    Raises
    ------
    InputError : fewer than two walls, or only some of them in metres.
    SettingsError : `near` is not positive and finite.
    """
    if not 0 < near < math.inf:
        raise SettingsError(f"near: expected a positive, finite number of metres, got {near}")
    if len(walls) < 2:
        raise InputError("merge needs at least two scans")
    if len({wall.metric for wall in walls}) > 1:
        raise InputError(
            "some of the scans are in metres and some are not; they cannot share a frame"
        )
    kept: list[WallModel] = []
    for number, wall in enumerate(walls):
        keep = np.ones(len(wall.mesh.faces), dtype=bool)
        for newer in walls[number + 1 :]:
            keep &= ~_whole_holds(wall, _covered_faces(wall, newer, near))
        if keep.any():
            shown = set(np.unique(wall.face_instance[keep]).tolist()) - {0}
            kept.append(keep_faces(wall, keep, shown))
    return _joined(kept, title)


def _joined(walls: Sequence[WallModel], title: str) -> WallModel:
    labels, holds, routes = [], [], []
    first_hold = first_route = 0
    for wall in walls:
        ids = wall.face_instance
        labels.append(np.where(ids > 0, ids + first_hold, 0).astype(np.int32))
        new_holds, new_routes = _renumber_rows(wall, first_hold, first_route)
        holds += new_holds
        routes += new_routes
        first_hold = max([first_hold, *(hold.id for hold in new_holds)])
        first_route = max([first_route, *(route.id for route in new_routes)])
    uv = [wall.uv for wall in walls]
    textured = all(part is not None for part in uv)
    return WallModel(
        mesh=joined_meshes([wall.mesh for wall in walls]),
        face_instance=np.concatenate(labels),
        uv=np.vstack([part for part in uv if part is not None]) if textured else None,
        texture=walls[0].texture if textured else None,
        holds=holds,
        routes=routes,
        metric=walls[0].metric,
        title=title,
    )
