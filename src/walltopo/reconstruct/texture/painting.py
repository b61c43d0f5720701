"""Paint the mesh with its photos, by the chosen backend."""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh
from walltopo.reconstruct.texture.atlas import make_texture
from walltopo.reconstruct.texture.openmvs import openmvs_texture
from walltopo.reconstruct.texture.settings import TextureSettings
from walltopo.scans.colmap_model import SparseModel
from walltopo.scans.context import Context
from walltopo.scans.manifest import Metrics
from walltopo.scans.photos import PhotoSet
from walltopo.scans.pictures import TextureImage, TextureUv

Painted = tuple[TextureImage, TextureUv, Metrics]


def paint_mesh(
    photos: PhotoSet,
    sparse: SparseModel,
    mesh: Mesh,
    settings: TextureSettings,
    context: Context,
) -> Painted:
    """Return the atlas that the photos paint onto the mesh, its UVs, and figures."""
    paint = _openmvs if settings.backend == "openmvs" else _embedded
    return paint(photos, sparse, mesh, settings, context)


def _openmvs(
    photos: PhotoSet,
    sparse: SparseModel,
    mesh: Mesh,
    settings: TextureSettings,
    context: Context,
) -> Painted:
    """Paint by OpenMVS."""
    work = Path(tempfile.mkdtemp(prefix="openmvs-texture-", dir=context.cache))
    image, uv, seen = openmvs_texture(
        mesh, sparse.folder, photos.folder, work, settings, context.progress
    )
    # Kept after an error, for its logs.
    shutil.rmtree(work)
    return _stored(mesh, image, uv, ~seen, {"size": max(image.shape)}, context)


def _embedded(
    photos: PhotoSet,
    sparse: SparseModel,
    mesh: Mesh,
    settings: TextureSettings,
    context: Context,
) -> Painted:
    """Paint by walltopo itself."""
    texture = make_texture(mesh, sparse.views, photos.read_rgb, settings, context.progress)
    unseen = texture.label < 0
    figures = {
        "size": settings.size,
        "charts": texture.charts,
        "photos_used": len(np.unique(texture.label[~unseen])),
        "texels_per_photo_pixel": round(texture.scale, 3),
    }
    return _stored(mesh, texture.image, texture.uv, unseen, figures, context)


def _stored(
    mesh: Mesh,
    image: NDArray[np.uint8],
    uv: NDArray[np.float32],
    unseen: NDArray[np.bool_],
    figures: dict[str, float],
    context: Context,
) -> Painted:
    """The artifacts and the stage's figures."""
    picture = context.scratch / "texture.png"
    cv2.imwrite(str(picture), image[..., ::-1], [cv2.IMWRITE_PNG_COMPRESSION, 3])
    area = float(mesh.areas[unseen].sum() / max(mesh.areas.sum(), 1e-12))
    figures |= {"unseen_faces": int(unseen.sum()), "unseen_area_share": round(area, 4)}
    return TextureImage(picture), TextureUv(uv), dict(figures)
