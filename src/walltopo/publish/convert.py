"""One wall, or a part of it, as one file of a chosen format."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from walltopo.core import InputError, Progress, Silent
from walltopo.core.files import atomic_path
from walltopo.publish.atlas.visible_faces import front_direction
from walltopo.publish.settings import ExportSettings
from walltopo.publish.tiers import TierBuilder
from walltopo.publish.wall_data import Wall, keep_faces
from walltopo.scans.folder import ScanFolder

FORMATS = {
    "glb": ".glb",
    "glb-web": ".glb",
    "obj": ".obj",
    "ply": ".ply",
    "painted-ply": ".ply",
    "usdz": ".usdz",
    "geojson": ".geojson",
    "csv": ".csv",
    "labelme": "",
    "page": ".html",
    "site": "",
}

# Those without a suffix are folders.
FOLDERS = frozenset(kind for kind, suffix in FORMATS.items() if not suffix)


def _glb(path: Path, wall: Wall, settings: ExportSettings, web: bool) -> None:
    data = TierBuilder(wall, settings).glb("first" if web else "archive")
    with atomic_path(path) as temporary:
        temporary.write_bytes(data)


def _usdz(path: Path, wall: Wall, settings: ExportSettings) -> None:
    from walltopo.publish.files.usdz import write_usdz
    from walltopo.publish.texture_image import encode_picture

    look, picture = TierBuilder(wall, settings).look("first"), None
    if look.picture is not None:
        picture, _ = encode_picture(look.picture, settings.first_texture, "JPEG")
    write_usdz(path, look.surface, picture)


def _page(path: Path, wall: Wall, settings: ExportSettings) -> None:
    from walltopo.publish.web_page import write_single_page

    builder = TierBuilder(wall, settings)
    write_single_page(path, wall.title, detail=builder.glb("detail"), first=builder.glb("first"))


def _site(folder: Path, wall: Wall, settings: ExportSettings) -> None:
    from walltopo.publish.web_page import write_page, write_tier

    builder, assets = TierBuilder(wall, settings), folder / "page"
    assets.mkdir(parents=True, exist_ok=True)
    for name in ("detail", "first"):
        write_tier(assets, name, builder.glb(name))
    write_page(folder / "index.html", assets, wall.title)


def convert(
    wall: Wall,
    kind: str,
    path: Path,
    *,
    scan: ScanFolder | None = None,
    settings: ExportSettings | None = None,
    progress: Progress | None = None,
) -> None:
    """Write `wall` to `path` (for `labelme` and `site`, a folder).

    Parameters
    ----------
    kind : a key of `FORMATS`.
    scan : where the photos are; needed by `labelme` alone.
    """
    from walltopo.publish.files.labelme import write_labelme
    from walltopo.publish.files.listings import write_csv, write_geojson
    from walltopo.publish.files.meshes import write_labelled_ply, write_obj, write_painted_ply

    settings, progress = settings or ExportSettings(), progress or Silent()
    if kind in ("glb", "glb-web"):
        _glb(path, wall, settings, web=kind == "glb-web")
    elif kind == "usdz":
        _usdz(path, wall, settings)
    elif kind in ("page", "site"):
        (_page if kind == "page" else _site)(path, wall, settings)
    elif kind == "labelme":
        if scan is None:
            raise InputError("labelme needs a scan folder with its photos")
        write_labelme(path, scan, wall, progress)
    elif kind in FORMATS:
        write = {
            "obj": write_obj,
            "ply": write_labelled_ply,
            "painted-ply": write_painted_ply,
            "geojson": write_geojson,
            "csv": write_csv,
        }[kind]
        write(path, wall)
    else:
        raise InputError(f"unknown format {kind!r}; there are {', '.join(FORMATS)}")


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
