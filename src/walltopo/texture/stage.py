"""The texture stage: photos onto the mesh, as one atlas."""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh
from walltopo.scans.context import Context
from walltopo.scans.texture import TextureImage, TextureUv
from walltopo.texture.atlas import make_texture
from walltopo.texture.contract import Reads, TextureSettings, Writes
from walltopo.texture.openmvs import openmvs_texture

__all__ = ["run"]


def run(reads: Reads, settings: TextureSettings, context: Context) -> Writes:
    """Paint the mesh with its photos."""
    return (_openmvs if settings.backend == "openmvs" else _embedded)(reads, settings, context)


def _openmvs(reads: Reads, settings: TextureSettings, context: Context) -> Writes:
    """Paint by OpenMVS."""
    work = Path(tempfile.mkdtemp(prefix="openmvs-texture-", dir=context.cache))
    image, uv, seen = openmvs_texture(
        reads.mesh, reads.sparse.folder, reads.photos.folder, work, settings, context.progress
    )
    # Kept after an error, for its logs.
    shutil.rmtree(work)
    return _writes(reads.mesh, image, uv, ~seen, {"size": max(image.shape)}, context)


def _embedded(reads: Reads, settings: TextureSettings, context: Context) -> Writes:
    """Paint by walltopo itself."""
    mesh = reads.mesh
    texture = make_texture(
        mesh, reads.sparse.views, reads.photos.read_rgb, settings, context.progress
    )
    unseen = texture.label < 0
    figures = {
        "size": settings.size,
        "charts": texture.charts,
        "photos_used": len(np.unique(texture.label[~unseen])),
        "texels_per_photo_pixel": round(texture.scale, 3),
    }
    return _writes(mesh, texture.image, texture.uv, unseen, figures, context)


def _writes(
    mesh: Mesh,
    image: NDArray[np.uint8],
    uv: NDArray[np.float32],
    unseen: NDArray[np.bool_],
    figures: dict[str, float],
    context: Context,
) -> Writes:
    """The artifacts and the stage's figures."""
    picture = context.scratch / "texture.png"
    cv2.imwrite(str(picture), image[..., ::-1], [cv2.IMWRITE_PNG_COMPRESSION, 3])
    area = float(mesh.areas[unseen].sum() / max(mesh.areas.sum(), 1e-12))
    figures |= {"unseen_faces": int(unseen.sum()), "unseen_area_share": round(area, 4)}
    return Writes(TextureImage(picture), TextureUv(uv), dict(figures))
