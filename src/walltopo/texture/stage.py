"""The texture stage: read the scan, paint, write the atlas."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np

from walltopo.core import Progress
from walltopo.imaging.photo_file import read_rgb
from walltopo.meshes.ply import read_mesh
from walltopo.scans.folder import ScanFolder, atomic_path
from walltopo.scans.model import read_views
from walltopo.texture.atlas import Texture, make_texture
from walltopo.texture.contract import TextureSettings

__all__ = ["run", "write_texture"]


def run(scan: ScanFolder, settings: TextureSettings, progress: Progress) -> dict[str, Any]:
    """Write `texture.png` and `texture.npz` from the mesh and the photos."""
    mesh = read_mesh(scan.mesh)
    views = read_views(scan.sparse)
    texture = make_texture(
        mesh, views, lambda name: read_rgb(scan.photos / name), settings, progress
    )
    write_texture(scan, texture)
    return {
        "size": settings.size,
        "charts": texture.charts,
        "photos_used": len(np.unique(texture.label[texture.label >= 0])),
        "texels_per_photo_pixel": round(texture.scale, 3),
        "unseen_faces": int((texture.label < 0).sum()),
        "unseen_area_share": round(
            float(mesh.areas[texture.label < 0].sum() / max(mesh.areas.sum(), 1e-12)), 4
        ),
    }


def write_texture(scan: ScanFolder, texture: Texture) -> None:
    """Write the atlas and its coordinates, each atomically."""
    with atomic_path(scan.texture) as temporary:
        cv2.imwrite(str(temporary), texture.image[..., ::-1], [cv2.IMWRITE_PNG_COMPRESSION, 3])
    with atomic_path(scan.texture_uv) as temporary, temporary.open("wb") as stream:
        np.savez_compressed(stream, uv=texture.uv)
