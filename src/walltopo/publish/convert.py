"""Write one wall, or a part of it, as one file of a chosen format."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from walltopo.core import InputError, Progress, Silent
from walltopo.core.files import atomic_path, scratch_beside
from walltopo.publish.settings import ExportSettings
from walltopo.publish.tiers import TierBuilder
from walltopo.publish.wall_data import WallModel, keep_faces
from walltopo.scans.folder import ScanFolder

FORMATS = {
    "glb": ".glb",
    "glb-web": ".glb",
    "obj": ".obj",
    "ply": ".ply",
    "painted-ply": ".ply",
    "usdz": ".usdz",
    "csv": ".csv",
    "labelme": "",
    "page": ".html",
    "site": "",
    "tactile": "",
}

# Formats without a suffix are folders.
FOLDERS = frozenset(kind for kind, suffix in FORMATS.items() if not suffix)


def _glb(path: Path, wall: WallModel, settings: ExportSettings, web: bool) -> None:
    data = TierBuilder(wall, settings).glb("first" if web else "archive")
    with atomic_path(path) as temporary:
        temporary.write_bytes(data)


def _usdz(path: Path, wall: WallModel, settings: ExportSettings) -> None:
    from walltopo.publish.files.usdz import write_usdz
    from walltopo.publish.texture_image import encode_picture

    look, picture = TierBuilder(wall, settings).textured_surface("first"), None
    if look.picture is not None:
        picture, _ = encode_picture(look.picture, settings.first_texture, "JPEG")
    write_usdz(path, look.surface, picture)


def _page(path: Path, wall: WallModel, settings: ExportSettings) -> None:
    from walltopo.publish.web_page import write_single_page

    builder = TierBuilder(wall, settings)
    write_single_page(path, wall.title, detail=builder.glb("detail"), first=builder.glb("first"))


def _site(folder: Path, wall: WallModel, settings: ExportSettings) -> None:
    from walltopo.publish.outputs import page_labels
    from walltopo.publish.page_tiers import page_tiers
    from walltopo.publish.web_page import write_labels, write_page

    # A copy is not edited, so its tiers are cut along the present borders of holds.
    wall, assets = replace(wall, patches=None), folder / "page"
    assets.mkdir(parents=True, exist_ok=True)
    with scratch_beside(folder) as scratch:
        page_tiers(wall, settings, scratch / "tiers").link_into(assets)
    write_labels(assets, page_labels(wall))
    write_page(folder / "index.html", assets, wall.title)


def convert(
    wall: WallModel,
    kind: str,
    path: Path,
    *,
    scan: ScanFolder | None = None,
    settings: ExportSettings | None = None,
    progress: Progress | None = None,
) -> None:
    """Write `wall` to `path` (for `labelme`, `site` and `tactile`, a folder).

    Parameters
    ----------
    kind : a key of `FORMATS`.
    scan : the scan folder with the photos; needed only by `labelme`.
    """
    from walltopo.publish.files.labelme import write_labelme
    from walltopo.publish.files.listings import write_csv
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
    elif kind == "tactile":
        _tactile(path, wall)
    elif kind in FORMATS:
        write = {
            "obj": write_obj,
            "ply": write_labelled_ply,
            "painted-ply": write_painted_ply,
            "csv": write_csv,
        }[kind]
        write(path, wall)
    else:
        raise InputError(f"unknown format {kind!r}; expected one of {', '.join(FORMATS)}")


def _tactile(folder: Path, wall: WallModel) -> None:
    from walltopo.publish.tactile.drawing import write_drawing
    from walltopo.publish.tactile.relief import PITCH_M, route_relief
    from walltopo.publish.tactile.solid import solid_of, write_3mf, write_stl

    if len(wall.routes) != 1:
        raise InputError("a relief shows one route", "Choose it with --route.")
    relief = route_relief(wall, wall.routes[0])
    folder.mkdir(parents=True, exist_ok=True)
    vertices, faces = solid_of(relief.heights, PITCH_M)
    write_stl(folder / "relief.stl", vertices, faces)
    write_3mf(folder / "relief.3mf", vertices, faces)
    write_drawing(folder / "drawing.pdf", relief)


AROUND = 0.8  # metres of wall kept around a route's holds


def one_route(wall: WallModel, route_id: int) -> WallModel:
    """Return the whole wall with one route.

    Raises
    ------
    InputError : the route does not exist (the message lists the routes that do).
    """
    chosen = [route for route in wall.routes if route.id == route_id]
    if not chosen:
        known = ", ".join(str(route.id) for route in wall.routes) or "none"
        raise InputError(f"no route {route_id} in this scan; its routes: {known}")
    return replace(wall, routes=chosen)


def crop_route(wall: WallModel, route_id: int) -> WallModel:
    """Return one route alone: its holds, the volumes near them, and the wall around them.

    Raises
    ------
    InputError : the route does not exist (the message lists the routes that do).
    """
    from scipy.spatial import cKDTree

    members = set(one_route(wall, route_id).routes[0].holds)
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
