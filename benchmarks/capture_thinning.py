"""Photos that a wall and its scale plates need: gym-a with fewer and fewer photos, against truth.

    python -m benchmarks.capture_thinning --scan SCAN --truth DATA/gym-a

SCAN is a finished scan of gym-a (to the stage `scale`) that still has `work/features`. Its features
and matches are reused; mapping and scale run again for every row.
"""

from __future__ import annotations

import argparse
import shutil
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.reconstruction_poses import centres, fit_on_floor, load_truth, matched
from walltopo.core import Camera, Silent, StageError, View
from walltopo.geometry.similarity import Similarity
from walltopo.geometry.zbuffer import render_ids
from walltopo.images.markers import Detection
from walltopo.reconstruct.scale.from_plates import frame_from_plates
from walltopo.reconstruct.scale.plates import Plate, built_in_plates
from walltopo.reconstruct.scale.world_frame import detect_in_photos, up_from_cameras
from walltopo.reconstruct.settings import SparseSettings
from walltopo.reconstruct.sparse.feature_cache import database_of
from walltopo.reconstruct.sparse.jobs import (
    ImageEntry,
    MapTask,
    camera_entries,
    features_job,
    mapping_job,
    photo_ids,
    run_worker,
)
from walltopo.scans.colmap_model import read_views
from walltopo.scans.folder import ScanFolder
from walltopo.scans.photos import PhotoList, PhotoSet

Floats = NDArray[np.float64]
_WALL = 60  # photos 0 to 59 show the wall, 60 to 71 the scale plates
_LENGTH = 10.0  # m of wall
_NEAR = 0.02  # m; a surface point is visible if the rendered depth equals its own within this


def map_subset(scan: ScanFolder, names: Sequence[str], work: Path) -> list[View]:
    """Map only the named photos from the scan's features and matches; return the views."""
    photos = sorted(PhotoList.load(scan.photo_list).photos, key=lambda photo: photo.name)
    database = work / "features.db"
    shutil.copyfile(database_of(scan.work), database)
    cameras, indices = camera_entries(photos)
    images = [ImageEntry(photo.name, k) for photo, k in zip(photos, indices, strict=True)]
    job = features_job(database, scan.photos, SparseSettings(), cameras, images, photo_ids(photos))
    task = MapTask(str(work / "mapping"), len(names), only=tuple(names))
    result = run_worker(mapping_job(job, task), Silent())
    return read_views(Path(result.best)) if result.best else []


def in_world(view: View, world: Similarity) -> View:
    """Return the view in the world frame."""
    rotation = view.cam_from_world[:, :3] @ world.rotation.T
    return replace(view, cam_from_world=np.c_[rotation, -rotation @ world.apply(view.centre)])


def coverage(truth_folder: Path, names: Sequence[str]) -> NDArray[np.bool_]:
    """Return (photos, points) bool: visibility of area-sampled hold surface in each photo."""
    gt = np.load(truth_folder / "gt.npz")
    vertices, faces = gt["vertices"].astype(np.float64), gt["faces"]
    chosen = np.flatnonzero((gt["face_instance"] > 0) & (gt["face_views"] > 0))
    corners = vertices[faces[chosen]]
    areas = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    rng = np.random.default_rng(0)
    points = corners[rng.choice(len(chosen), 20_000, p=areas / areas.sum())].mean(axis=1)
    fx, fy, cx, cy = gt["intrinsics"].tolist()
    width, height = gt["size"].tolist()
    camera = Camera("PINHOLE", width, height, (fx, fy, cx, cy)).scaled(0.5)
    poses = load_truth(truth_folder)
    return np.array([_shows(vertices, faces, camera, poses[name], points) for name in names])


def _shows(
    vertices: Floats, faces: NDArray[np.int32], camera: Camera, pose: Floats, points: Floats
) -> NDArray[np.bool_]:
    depth = render_ids(vertices, faces, camera, pose)[1]
    local = points @ pose[:, :3].T + pose[:, 3]
    xy = np.nan_to_num(camera.project(local), nan=-1.0)
    inside = ((xy >= 0) & (xy < [camera.width, camera.height])).all(axis=1)
    column, row = (np.where(inside, xy[:, k], 0).astype(int) for k in (0, 1))
    return np.asarray(inside & (np.abs(depth[row, column] - local[:, 2]) < _NEAR))


def judge_row(
    label: str,
    views: list[View],
    given: int,
    detections: Sequence[Detection],
    plates: Sequence[Plate],
    truth: dict[str, Floats],
    seen: dict[str, NDArray[np.bool_]] | None = None,
) -> None:
    """Print one row: registered photos, centres, scale, up, and the share of holds in 3 photos."""
    row = f"| {label} | {len(views)} of {given} |"
    if seen is not None:
        counts = np.sum([seen[view.name] for view in views], axis=0)
        row += f" {100 * (counts >= 3).mean():.0f} % |"
    if not views:
        print(f"{row} not reconstructed |")
        return
    try:
        up = up_from_cameras(views)
        measure, _, notes = frame_from_plates(views, detections, plates, up)
    except StageError as failure:
        print(f"{row} {failure.message} |")
        return
    if measure is None:
        print(f"{row} unscaled: {'; '.join(notes) or 'no plate seen'} |")
        return
    placed = [in_world(view, measure.world_from_model) for view in views]
    scan, real = matched(placed, truth)
    a, b = centres(scan), centres(real)
    apart = 1000 * np.linalg.norm(fit_on_floor(a, b).apply(a) - b, axis=1)
    a0, b0 = a - a.mean(axis=0), b - b.mean(axis=0)
    u, singular, vt = np.linalg.svd(b0.T @ a0)
    rotation = u @ np.diag([1, 1, np.linalg.det(u @ vt)]) @ vt
    tilt = np.degrees(np.arccos(np.clip(rotation[2, 2], -1, 1)))
    error = 100 * ((a0**2).sum() / singular.sum() - 1)
    print(f"{row} {np.median(apart):.1f} / {apart.max():.1f} mm | {error:+.2f} % | {tilt:.2f}° |")


def thin_photos(scan: ScanFolder, truth_folder: Path, detections: Sequence[Detection]) -> None:
    """Print the table of walls with fewer and fewer photos."""
    truth, plates = load_truth(truth_folder), built_in_plates()[:3]
    names = sorted(truth)
    shown = dict(zip(names, coverage(truth_folder, names), strict=True))
    wall, measures = names[:_WALL], names[_WALL:]
    print(
        "| photos | per metre of wall | registered | surface of the holds in 3 or more photos "
        "| camera centres, median / worst | scale | up |\n|---|---|---|---|---|---|---|"
    )
    with tempfile.TemporaryDirectory() as work:
        for step in (1, 2, 3, 4, 6):
            kept = [*wall[::step], *measures]
            views = map_subset(scan, kept, Path(work))
            count = len(wall[::step])
            label = f"{count} + {len(measures)} of the measures | {count / _LENGTH:g}"
            judge_row(label, views, len(kept), detections, plates, truth, shown)


def thin_measures(scan: ScanFolder, truth_folder: Path, detections: Sequence[Detection]) -> None:
    """Print the table of fewer and fewer plates and photos of them."""
    truth, plates = load_truth(truth_folder), built_in_plates()[:3]
    views, measures = read_views(scan.sparse), sorted(truth)[_WALL:]
    print("\n| plates, photos of each | registered | camera centres, median / worst | scale | up |")
    print("|---|---|---|---|---|")
    for plate_count in (3, 2, 1):
        for photos in (4, 3, 2):
            some = [
                d
                for number, plate in enumerate(plates[:plate_count])
                for d in detections
                if d.marker in plate.ids and d.photo in measures[4 * number :][:photos]
            ]
            label = f"{plate_count} in {photos}"
            judge_row(label, views, len(truth), some, plates, truth)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scan", type=Path, required=True)
    parser.add_argument("--truth", type=Path, required=True)
    parser.add_argument("--table", choices=("photos", "measures", "both"), default="both")
    args = parser.parse_args()
    scan, names = ScanFolder(args.scan), sorted(load_truth(args.truth))
    detections = detect_in_photos(PhotoSet(scan.photos), names, built_in_plates()[:3], Silent())
    if args.table != "measures":
        thin_photos(scan, args.truth, detections)
    if args.table != "photos":
        thin_measures(scan, args.truth, detections)
    return 0


if __name__ == "__main__":
    sys.exit(main())
