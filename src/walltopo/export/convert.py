"""One wall as one file of a chosen format."""

from __future__ import annotations

from pathlib import Path

from walltopo.core import InputError, Progress, Silent
from walltopo.core.files import atomic_path
from walltopo.export.contract import ExportSettings
from walltopo.export.tiers import TierBuilder
from walltopo.export.wall import Wall
from walltopo.scans.folder import ScanFolder

__all__ = ["FOLDERS", "FORMATS", "convert"]

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
    from walltopo.export.files.usdz import write_usdz
    from walltopo.export.picture import encode_picture

    look, picture = TierBuilder(wall, settings).look("first"), None
    if look.picture is not None:
        picture, _ = encode_picture(look.picture, settings.first_texture, "JPEG")
    write_usdz(path, look.surface, picture)


def _page(path: Path, wall: Wall, settings: ExportSettings) -> None:
    from walltopo.export.webpage import write_single_page

    builder = TierBuilder(wall, settings)
    write_single_page(path, wall.title, detail=builder.glb("detail"), first=builder.glb("first"))


def _site(folder: Path, wall: Wall, settings: ExportSettings) -> None:
    from walltopo.export.webpage import write_page, write_tier

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
    from walltopo.export.files.labelme import write_labelme
    from walltopo.export.files.listings import write_csv, write_geojson
    from walltopo.export.files.meshes import write_labelled_ply, write_obj, write_painted_ply

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
