"""Run the stage `texture`: photos to one texture atlas of the mesh."""

from __future__ import annotations

import shutil
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from walltopo.core import Mesh
from walltopo.pipeline.stage import Cost, Stage
from walltopo.reconstruct.settings import TextureSettings
from walltopo.scans.artifacts import Context, figures, of
from walltopo.scans.colmap_model import SparseModel
from walltopo.scans.folder import ScanFolder
from walltopo.scans.manifest import Metrics
from walltopo.scans.photos import PhotoSet
from walltopo.scans.pictures import TextureImage, TextureUv

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


@dataclass(frozen=True)
class Reads:
    """The artifacts that the stage reads."""

    photos: PhotoSet = of(ScanFolder.photos)
    sparse: SparseModel = of(ScanFolder.sparse)
    mesh: Mesh = of(ScanFolder.mesh)
    given_texture: TextureImage | None = of(ScanFolder.given_texture)
    given_uv: TextureUv | None = of(ScanFolder.given_uv)


@dataclass(frozen=True)
class Writes:
    """The artifacts and metrics that the stage writes."""

    texture: TextureImage = of(ScanFolder.texture)
    texture_uv: TextureUv = of(ScanFolder.texture_uv)
    metrics: Metrics = figures()


def check(settings: TextureSettings) -> None:
    """Raise EnvironmentLacksError if this machine lacks what the settings need."""
    if settings.backend == "openmvs":
        from walltopo.reconstruct.openmvs import find_programs

        find_programs(settings.openmvs_bin)


def run(reads: Reads, settings: TextureSettings, context: Context) -> Writes:
    """Paint the photos onto the mesh; the own texture of a ready mesh is kept."""
    if reads.given_texture is not None and reads.given_uv is not None:
        return _keep_given_texture(reads, reads.given_texture, reads.given_uv, context)
    paint = _paint_with_openmvs if settings.backend == "openmvs" else _paint_embedded
    return paint(reads, settings, context)


TEXTURE = Stage("texture", Reads, Writes, run, check, version=3, cost=Cost(19, 0.36))


def _keep_given_texture(
    reads: Reads, picture: TextureImage, uv: TextureUv, context: Context
) -> Writes:
    """Keep the texture that came with a ready mesh."""
    uv.check_fits(reads.mesh)
    copy = context.scratch / "texture.png"
    shutil.copyfile(picture.path, copy)
    return Writes(TextureImage(copy), uv, {"given": True, "unseen_faces": 0})


def _paint_with_openmvs(reads: Reads, settings: TextureSettings, context: Context) -> Writes:
    """Paint with OpenMVS."""
    from walltopo.reconstruct.texture.openmvs import openmvs_texture

    work = Path(tempfile.mkdtemp(prefix="openmvs-texture-", dir=context.cache))
    image, uv, seen = openmvs_texture(
        reads.mesh, reads.sparse.folder, reads.photos.folder, work, settings, context.progress
    )
    # After an error the folder stays, because it holds the logs.
    shutil.rmtree(work)
    return _write_outputs(reads.mesh, image, uv, ~seen, {"size": max(image.shape)}, context)


def _paint_embedded(reads: Reads, settings: TextureSettings, context: Context) -> Writes:
    """Paint with the embedded backend."""
    from walltopo.reconstruct.texture.atlas import make_texture

    photos = reads.photos
    texture = make_texture(
        reads.mesh,
        reads.sparse.views,
        photos.read_rgb,
        settings,
        context.progress,
        photos.people_mask,
    )
    used = {photo for photo in texture.label.tolist() if photo >= 0}
    figures = {
        "size": settings.size,
        "charts": texture.charts,
        "photos_used": len(used),
        "texels_per_photo_pixel": round(texture.scale, 3),
    }
    return _write_outputs(
        reads.mesh, texture.image, texture.uv, texture.label < 0, figures, context
    )


def _write_outputs(
    mesh: Mesh,
    image: NDArray[np.uint8],
    uv: NDArray[np.float32],
    unseen: NDArray[np.bool_],
    figures: dict[str, float],
    context: Context,
) -> Writes:
    """Write the atlas to the scratch folder, and add the metrics of unseen triangles."""
    import cv2

    picture = context.scratch / "texture.png"
    cv2.imwrite(str(picture), image[..., ::-1], [cv2.IMWRITE_PNG_COMPRESSION, 3])
    area = float(mesh.areas[unseen].sum() / max(mesh.areas.sum(), 1e-12))
    figures |= {"unseen_faces": int(unseen.sum()), "unseen_area_share": round(area, 4)}
    return Writes(TextureImage(picture), TextureUv(uv), dict(figures))
