"""The tiers of a scan's page: geometry, texture and patches, which no edit changes.

Finished files are cached in `work/tiers` under a hash of their inputs, so that an edit builds and
writes no geometry.
"""

from __future__ import annotations

import hashlib
import os
import shutil
from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError
from walltopo.core.files import atomic_path, hash_path
from walltopo.publish.gltf import write_glb
from walltopo.publish.meshopt import available
from walltopo.publish.settings import ExportSettings
from walltopo.publish.shown import part_shown
from walltopo.publish.surface import Surface, TexturedSurface
from walltopo.publish.texture_image import decode_picture, encode_picture
from walltopo.publish.tiers import TierBuilder
from walltopo.publish.wall_data import WallModel, read_wall
from walltopo.publish.web_page import LABELS, write_tier
from walltopo.scans.document import Document, read_arrays
from walltopo.scans.folder import ScanFolder
from walltopo.scans.manifest import Manifest

TIERS = "tiers"  # the folder's name, in `work/`
NAMES = ("detail", "first")
AR_FILES = ("ar.usdz", "ar.glb")
VERSION = 4  # increase when the tiers change
_INDEX, _LOOK, _COVERAGE = "index.json", "first.npz", "coverage.npz"
_SURFACE = tuple(field.name for field in fields(Surface))


class _Index(Document, frozen=True, kw_only=True):
    """The key of a folder of tiers, its files' hashes, and each tier's number of triangles."""

    made_from: str
    files: dict[str, str]
    triangles: dict[str, int]


@dataclass(frozen=True)
class PageTiers:
    """The finished tiers in a folder.

    Parameters
    ----------
    triangles : number of triangles of each tier, by name.
    """

    folder: Path
    triangles: dict[str, int]

    def link_into(self, folder: Path) -> None:
        """Put the files of the page into a folder, as hard links if the file system has them."""
        of_page = [f"{name}.{suffix}" for name in NAMES for suffix in ("glb", "js")]
        for file in [*of_page, *(name for name in AR_FILES if (self.folder / name).exists())]:
            try:
                os.link(self.folder / file, folder / file)
            except OSError:
                shutil.copyfile(self.folder / file, folder / file)

    def megabytes(self, name: str) -> float:
        """Return the size of a tier in megabytes."""
        return round((self.folder / f"{name}.glb").stat().st_size / 1e6, 3)

    def coverage(self) -> NDArray[np.int32]:
        """Return the (F,) number of photos that see each face of the mesh."""
        return read_arrays(self.folder / _COVERAGE, "counts")[0].astype(np.int32)

    def shown(self) -> NDArray[np.bool_]:
        """Return (F,) the faces of the mesh that the tiers show."""
        return read_arrays(self.folder / _COVERAGE, "shown")[0].astype(np.bool_)

    def first(self) -> TexturedSurface:
        """Return the first tier, for drawings."""
        *parts, picture = read_arrays(self.folder / _LOOK, *_SURFACE, "picture")
        values: dict[str, Any] = {
            name: part if part.size else None for name, part in zip(_SURFACE, parts, strict=True)
        }
        encoded = picture.tobytes()
        return TexturedSurface(Surface(**values), decode_picture(encoded) if encoded else None)


def page_tiers(
    wall: WallModel,
    settings: ExportSettings,
    folder: Path,
    advance: Callable[[], None] = lambda: None,
) -> PageTiers:
    """Return the tiers of a wall's page, built only if the cached ones have another key.

    Parameters
    ----------
    folder : cache of finished tiers; may be deleted at any time.
    advance : called after each tier.
    """
    key = _made_from(wall, settings)
    kept = _kept(folder, key)
    if kept is None:
        folder.parent.mkdir(parents=True, exist_ok=True)
        with atomic_path(folder) as temporary:
            temporary.mkdir()
            _make(wall, settings, temporary, key, advance)
        kept = _kept(folder, key)
        assert kept is not None
    else:
        for _ in NAMES:
            advance()
    return kept


def _kept(folder: Path, key: str) -> PageTiers | None:
    try:
        index = _Index.load(folder / _INDEX)
    except InputError:  # the cache is empty or unreadable
        return None
    if index.made_from != key:
        return None
    # The page's files may be hard links to these, so a changed file invalidates the cache.
    if any(hash_path(folder / name) != found for name, found in index.files.items()):
        return None
    return PageTiers(folder, index.triangles)


def _make(
    wall: WallModel, settings: ExportSettings, folder: Path, key: str, advance: Callable[[], None]
) -> None:
    builder = _tier_builder(wall, settings)
    triangles = {}
    for name in NAMES:
        triangles[name] = len(builder.textured_surface(name).surface.triangles)
        write_tier(folder, name, builder.page_glb(name, LABELS))
        advance()
    surface, picture = builder.textured_surface("first").surface, builder.picture("first")
    none = np.zeros(0, dtype=np.uint8)
    parts: dict[str, Any] = {
        name: none if (value := getattr(surface, name)) is None else value for name in _SURFACE
    }
    encoded = np.frombuffer(picture[0], dtype=np.uint8) if picture else none
    np.savez(folder / _LOOK, **parts, picture=encoded)
    if settings.ar_files:
        _write_ar_files(folder, builder.textured_surface("first"), settings)
    counts = builder.coverage.astype(np.uint16)
    np.savez_compressed(folder / _COVERAGE, counts=counts, shown=builder.shown)
    files = {path.name: hash_path(path) for path in sorted(folder.iterdir())}
    _Index(made_from=key, files=files, triangles=triangles).save(folder / _INDEX)


def _write_ar_files(folder: Path, look: TexturedSurface, settings: ExportSettings) -> None:
    """Write a surface for Quick Look and for Scene Viewer, which know neither meshopt nor WebP."""
    from walltopo.publish.files.usdz import write_usdz

    surface = replace(look.surface, feature=np.zeros_like(look.surface.feature), guessed=None)
    picture = None
    if look.picture is not None:
        picture = encode_picture(look.picture, settings.first_texture, "JPEG")
    usdz, glb = (folder / name for name in AR_FILES)
    write_usdz(usdz, surface, None if picture is None else picture[0])
    glb.write_bytes(write_glb(surface, [], [], picture=picture))


def _tier_builder(wall: WallModel, settings: ExportSettings) -> TierBuilder:
    """Return the builder of the tiers: names and edits do not influence the geometry."""
    patches = wall.face_instance if wall.patches is None else wall.patches
    return TierBuilder(replace(wall, face_instance=patches, holds=[], routes=[]), settings)


def read_shown_wall(scan: ScanFolder) -> WallModel:
    """Return the part of a finished scan's wall that its page shows.

    Raises
    ------
    InputError : as in `read_wall`.
    """
    wall = read_wall(scan)
    stored = Manifest.load(scan.manifest).settings.get("export", {})
    settings = msgspec.convert(stored, ExportSettings)
    kept = _kept(scan.work / TIERS, _made_from(wall, settings))
    return part_shown(wall, _tier_builder(wall, settings).shown if kept is None else kept.shown())


def _made_from(wall: WallModel, settings: ExportSettings) -> str:
    """Return a hash of the inputs of the tiers."""
    # Settings that msgspec converted have no attribute of their own for a default.
    sizes = {
        field.name: getattr(settings, field.name)
        for field in fields(settings)
        if field.name.startswith((*NAMES, "surroundings", "ar_files"))
    }
    digest = hashlib.blake2b(repr((VERSION, available(), sorted(sizes.items()))).encode())
    mesh, patches = wall.mesh, wall.face_instance if wall.patches is None else wall.patches
    for values in (mesh.vertices, mesh.faces, wall.uv, mesh.vertex_colours, patches):
        if values is not None:
            digest.update(np.ascontiguousarray(values).data)
        digest.update(b";")
    for view in wall.views:
        digest.update(repr(view.camera).encode() + view.cam_from_world.tobytes())
    if wall.hidden:
        digest.update(msgspec.json.encode(wall.hidden))
    if wall.texture is not None:
        digest.update(hash_path(wall.texture).encode())
    return digest.hexdigest()
