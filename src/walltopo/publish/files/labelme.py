"""Write hold outlines in every photo as LabelMe files: 3D results as 2D training labels."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError, Progress, View
from walltopo.core.files import join_inside, write_json
from walltopo.images.files import read_rgb
from walltopo.publish.wall_data import WallModel
from walltopo.scans.folder import ScanFolder
from walltopo.scans.hidden import hide_in_photo

MIN_PIXELS = 30  # a smaller hold gets no outline


def outlines(
    labels: NDArray[np.int32], tolerance: float = 1.0
) -> list[tuple[int, list[list[float]]]]:
    """Return outlines of each id in an (H, W) label picture, simplified to `tolerance` pixels."""
    import cv2

    found: list[tuple[int, list[list[float]]]] = []
    for id_ in np.unique(labels[labels > 0]).tolist():
        mask = np.ascontiguousarray(labels == id_).view(np.uint8)
        contours, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
        for contour in contours:
            if cv2.contourArea(contour) < MIN_PIXELS:
                continue
            line = cv2.approxPolyDP(contour, tolerance, True).reshape(-1, 2)
            if len(line) >= 3:
                # OpenCV's coordinates are pixel centres, LabelMe's are pixel corners.
                found.append((int(id_), (line + 0.5).astype(float).tolist()))
    return found


def _document(view: View, wall: WallModel, image: str) -> dict[str, Any]:
    from walltopo.geometry.zbuffer import render_ids

    face, _ = render_ids(wall.mesh.vertices, wall.mesh.faces, view.camera, view.cam_from_world)
    labels = np.where(face >= 0, wall.face_instance[face], 0).astype(np.int32)
    rows = {hold.id: hold for hold in wall.holds}
    shapes = []
    for id_, points in outlines(labels):
        row = rows[id_]
        shapes.append(
            {
                "label": row.kind,
                "points": points,
                "group_id": id_,
                "description": f"{row.colour} {row.type}",
                "shape_type": "polygon",
                "flags": {},
            }
        )
    return {
        "version": "5.5.0",
        "flags": {},
        "shapes": shapes,
        "imagePath": image,
        "imageData": None,
        "imageHeight": view.camera.height,
        "imageWidth": view.camera.width,
    }


def write_labelme(folder: Path, scan: ScanFolder, wall: WallModel, progress: Progress) -> int:
    """Write one `<photo>.json` per registered photo, beside a copy of it; return their number.

    Hidden places are hidden in the copies. Other files in the folder stay.

    Raises
    ------
    InputError : the scan has no camera poses, or a photo is missing.
    """
    import shutil

    from PIL import Image

    from walltopo.scans.colmap_model import read_views

    views = read_views(scan.sparse)
    progress.step("write hold outlines", len(views))
    folder.mkdir(parents=True, exist_ok=True)
    for view in views:
        photo = join_inside(scan.photos, view.name)
        if not photo.is_file():
            raise InputError(f"{photo}: the photo is missing")
        name = Path(view.name).name
        if wall.hidden:
            shown = Image.fromarray(hide_in_photo(read_rgb(photo), view, wall.hidden))
            shown.save(folder / name, quality=95, subsampling=0)
        else:
            shutil.copyfile(photo, folder / name)
        write_json((folder / name).with_suffix(".json"), _document(view, wall, name))
        progress.advance()
    return len(views)
