"""Take the photos of the tiny gym through the lens of any camera model of COLMAP."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL import Image

from walltopo.core import Camera

# Lens parameters of a phone, by COLMAP's model: what follows focal length and principal point.
LENSES: dict[str, tuple[float, ...]] = {
    "SIMPLE_PINHOLE": (),
    "PINHOLE": (),
    "SIMPLE_RADIAL": (0.08,),
    "RADIAL": (0.08, -0.03),
    "OPENCV": (0.08, -0.03, 0.002, -0.001),
    "FULL_OPENCV": (0.08, -0.03, 0.002, -0.001, 0.01, 0.02, -0.01, 0.004),
    "OPENCV_FISHEYE": (0.02, -0.01, 0.004, -0.001),
    "SIMPLE_RADIAL_FISHEYE": (0.02,),
    "RADIAL_FISHEYE": (0.02, -0.01),
    "SIMPLE_FISHEYE": (),
    "FISHEYE": (),
    "FOV": (0.5,),
    "THIN_PRISM_FISHEYE": (0.02, -0.01, 0.002, -0.001, 0.004, -0.001, 0.001, 0.001),
    "RAD_TAN_THIN_PRISM_FISHEYE": (0.02, -0.01, 0.004, 0, 0, 0, 0.001, 0.001, 0.001, 0, 0, 0),
    "SIMPLE_DIVISION": (-0.05,),
    "DIVISION": (-0.05,),
    "EUCM": (0.3, 1.1),
}
_ONE_FOCAL = ("SIMPLE_", "RADIAL")


def lens_params(model: str, camera: Camera) -> list[float]:
    """Return the parameters in COLMAP's order of a lens with a camera's focal length."""
    focal = [camera.fx] if model.startswith(_ONE_FOCAL) else [camera.fx, camera.fy]
    return [*focal, camera.cx, camera.cy, *LENSES[model]]


def distort_photos(
    photos: Path, camera: Camera, model: str, folder: Path, params: Sequence[float] = ()
) -> None:
    """Write the photos of a camera as COLMAP's camera of the model would have taken them."""
    import cv2

    from walltopo.geometry.colmap import pycolmap

    size = {"width": camera.width, "height": camera.height}
    lens = pycolmap.Camera(model=model, **size, params=list(params or lens_params(model, camera)))
    rows, columns = np.mgrid[: camera.height, : camera.width] + 0.5
    pixels = np.column_stack([columns.ravel(), rows.ravel()])
    rays = np.asarray(lens.cam_from_img(pixels), dtype=np.float64)
    at = camera.project(np.column_stack([rays, np.ones(len(rays))])) - 0.5
    x, y = (at[:, k].reshape(rows.shape).astype(np.float32) for k in (0, 1))
    folder.mkdir(parents=True)
    for file in sorted(photos.glob("*.jpg")):
        with Image.open(file) as picture:
            pixels_there, exif = np.asarray(picture.convert("RGB")), picture.getexif()
        seen = cv2.remap(pixels_there, x, y, cv2.INTER_CUBIC)
        Image.fromarray(seen).save(folder / file.name, quality=95, exif=exif)
