"""Errors of detected marker corners against truth: OpenCV's refinements and ours.

    python -m benchmarks.marker_corners DATA/gym-a GYM

Each GYM is a folder of `walltopo synth`, or of the rendered gym.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from walltopo.core import Camera, View
from walltopo.geometry.similarity import fit_similarity
from walltopo.images.files import read_grey
from walltopo.images.markers import Detection, detect_markers
from walltopo.reconstruct.scale.plates import built_in_plates

Floats = NDArray[np.float64]
_GYM_A_K1 = 0.035  # lens distortion of gym-a; generated gyms record their own
_OPENCV = {
    "OpenCV, no refinement": cv2.aruco.CORNER_REFINE_NONE,
    "OpenCV, subpixel": cv2.aruco.CORNER_REFINE_SUBPIX,
    "OpenCV, contour": cv2.aruco.CORNER_REFINE_CONTOUR,
    "OpenCV, AprilTag": cv2.aruco.CORNER_REFINE_APRILTAG,
}


def true_views(folder: Path, photos: Path) -> dict[str, View]:
    """Return the photos' views with exact cameras."""
    data = np.load(folder / "gt.npz")
    fx, _, cx, cy = data["intrinsics"].tolist()
    width, height = data["size"].tolist()
    k1 = float(data["distortion"][0]) if "distortion" in data else _GYM_A_K1
    camera = Camera("SIMPLE_RADIAL", width, height, (fx, cx, cy, k1))
    names = sorted(path.name for path in photos.iterdir())
    poses = zip(names, data["cam_from_world"], strict=True)
    return {name: View(name, camera, pose) for name, pose in poses}


def true_corners(folder: Path) -> dict[int, Floats]:
    """Return marker id to its (4, 3) corners in the world."""
    scene = json.loads((folder / "scene.json").read_text(encoding="utf-8"))
    corners: dict[int, Floats] = {}
    for entry, plate in zip(scene["plates"], built_in_plates(), strict=False):
        half = np.array(plate.size) / 2
        edges = np.array([[-half[0], -half[1], 0], [half[0], -half[1], 0], [*half, 0]])
        edges = np.vstack([edges, [[-half[0], half[1], 0]]])
        world = fit_similarity(edges, np.array(entry["corners_bl_br_tr_tl"]))
        corners |= {marker: world.apply(plate.corners(marker)) for marker in plate.ids}
    return corners


def by_opencv(grey: NDArray[np.uint8], photo: str, refinement: int) -> list[Detection]:
    """Return OpenCV's detections with one of its refinements."""
    parameters = cv2.aruco.DetectorParameters()
    parameters.cornerRefinementMethod = refinement
    table = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    quads, ids, _ = cv2.aruco.ArucoDetector(table, parameters).detectMarkers(grey)
    found = [] if ids is None else np.ravel(ids).tolist()
    return [
        Detection(photo, int(marker), np.asarray(quad, dtype=np.float64).reshape(4, 2) + 0.5)
        for quad, marker in zip(quads, found, strict=True)
    ]


def report(
    label: str, found: list[Detection], views: dict[str, View], truth: dict[int, Floats]
) -> None:
    """Print the length of the errors and their mean component away from the marker's centre."""
    errors, outwards, false = [], [], 0
    for detection in found:
        if detection.marker not in truth:
            false += 1
            continue
        real = views[detection.photo].project(truth[detection.marker])
        away = real - real.mean(axis=0)
        away /= np.linalg.norm(away, axis=1, keepdims=True)
        errors.append(np.linalg.norm(detection.corners - real, axis=1))
        outwards.append(((detection.corners - real) * away).sum(axis=1))
    lengths = np.concatenate(errors)
    print(
        f"| {label} | {len(errors)} | {false} | {np.median(lengths):.2f} px | "
        f"{np.percentile(lengths, 95):.2f} px | {np.mean(outwards):+.2f} px |"
    )


def judge(folder: Path) -> None:
    """Print the rows of one gym."""
    truth, photos = folder / "truth" if (folder / "truth").is_dir() else folder, folder / "photos"
    views, corners = true_views(truth, photos), true_corners(truth)
    greys = {name: read_grey(photos / name) for name in views}
    for label, refinement in _OPENCV.items():
        found = [d for name, grey in greys.items() for d in by_opencv(grey, name, refinement)]
        report(f"{folder.name} | {label}", found, views, corners)
    ours = [d for n, g in greys.items() for d in detect_markers(g, n, ["DICT_4X4_50"])]
    report(f"{folder.name} | walltopo", ours, views, corners)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("gyms", type=Path, nargs="+", metavar="GYM")
    folders = parser.parse_args().gyms
    print("| gym | corners by | markers | false | median error | 95 % | bias outwards |")
    print("|---|---|---|---|---|---|---|")
    for folder in folders:
        judge(folder)
    return 0


if __name__ == "__main__":
    sys.exit(main())
