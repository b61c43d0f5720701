"""The texture stage: photos onto the mesh, as one atlas."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError
from walltopo.scans.context import Context
from walltopo.scans.texture import TextureImage, TextureUv
from walltopo.texture.atlas import make_texture
from walltopo.texture.contract import Reads, TextureSettings, Writes

__all__ = ["run"]


def run(reads: Reads, settings: TextureSettings, context: Context) -> Writes:
    """Paint the mesh with its photos."""
    mesh = reads.mesh

    def load(name: str) -> NDArray[np.uint8]:
        image = cv2.imread(str(reads.photos.path(name)), cv2.IMREAD_COLOR)
        if image is None:
            raise InputError(
                f"{reads.photos.path(name)}: the photo cannot be read",
                "Run the scan again from ingest: walltopo scan --from ingest.",
            )
        return np.ascontiguousarray(image[..., ::-1], dtype=np.uint8)

    texture = make_texture(mesh, reads.sparse.views, load, settings, context.progress)
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
