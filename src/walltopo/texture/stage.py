"""The texture stage: photos onto the mesh, as one atlas."""

from __future__ import annotations

import cv2
import numpy as np

from walltopo.scans.context import Context
from walltopo.scans.texture import TextureImage, TextureUv
from walltopo.texture.atlas import make_texture
from walltopo.texture.contract import Reads, TextureSettings, Writes

__all__ = ["run"]


def run(reads: Reads, settings: TextureSettings, context: Context) -> Writes:
    """Paint the mesh with its photos."""
    mesh = reads.mesh

    texture = make_texture(
        mesh, reads.sparse.views, reads.photos.read_rgb, settings, context.progress
    )
    picture = context.scratch / "texture.png"
    cv2.imwrite(str(picture), texture.image[..., ::-1], [cv2.IMWRITE_PNG_COMPRESSION, 3])
    unseen = texture.label < 0
    return Writes(
        TextureImage(picture),
        TextureUv(texture.uv),
        {
            "size": settings.size,
            "charts": texture.charts,
            "photos_used": len(np.unique(texture.label[~unseen])),
            "texels_per_photo_pixel": round(texture.scale, 3),
            "unseen_faces": int(unseen.sum()),
            "unseen_area_share": round(
                float(mesh.areas[unseen].sum() / max(mesh.areas.sum(), 1e-12)), 4
            ),
        },
    )
