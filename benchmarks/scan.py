"""Whole scans from photos, as run by a user: registered photos, scale, holds, time, memory.

    python -m benchmarks.scan DATA            # the real spray wall and the rendered gym
    python -m benchmarks.scan DATA --only spraywall --keep FOLDER

DATA is the folder with `spraywall/` and `gym-a/`. Nothing is tuned on either. Times are also given
in units of the calibration (`benchmarks/calibration.py`), so that machines can be compared.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.calibration import calibration_s
from benchmarks.dense import print_table
from walltopo.core.files import read_json
from walltopo.geometry.mesh_files import read_mesh
from walltopo.geometry.zbuffer import render_ids
from walltopo.scans.colmap_model import read_views
from walltopo.scans.folder import ScanFolder

SCANS = ("spraywall", "gym-a")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data", type=Path, metavar="DATA")
    parser.add_argument("--only", choices=SCANS)
    parser.add_argument(
        "--keep", type=Path, help="keep the scans in this folder, and go on with what is there"
    )
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        root = args.keep or Path(temporary)
        names = [args.only] if args.only else SCANS
        results = {name: scan(args.data / name / "photos", root / name) for name in names}
        print_table({name: figures(args.data / name, results[name]) for name in names})
        for name in names:
            report_stages(name, results[name])
    return 0


def scan(photos: Path, out: Path) -> dict[str, Any]:
    """Run the command in a child process; return its figures.

    Stages already in a kept folder are not run again; their recorded times count.
    """
    command = [sys.executable, "-m", "walltopo", "scan", str(photos), "-o", str(out)]
    before = calibration_s()
    subprocess.run(command, check=True, stdout=sys.stderr)
    yardsticks = before, calibration_s()
    stages = read_json(out / "scan.json")["stages"]
    seconds = sum(record["seconds"] for record in stages.values())
    peak = max(record["peak_mb"] for record in stages.values())
    return {
        "folder": out,
        "seconds": seconds,
        "peak_mb": peak,
        "stages": stages,
        "calibrations_s": yardsticks,
    }


def figures(data: Path, result: dict[str, Any]) -> dict[str, str]:
    """Return the figures of one scan, name to text."""
    folder = ScanFolder(result["folder"])
    photos = read_json(folder.photo_list)["photos"]
    views = read_views(folder.sparse)
    met = [boxes_found(folder, file) for file in sorted((data / "labels").glob("*.txt"))]
    return {
        "photos registered": f"{len(views)} of {len(photos)}",
        "metric": "yes" if read_json(folder.scale)["metric"] else "no, with a warning",
        "instances shown": str(len(read_json(folder.holds)["holds"])),
        "routes": str(len(read_json(folder.routes)["routes"])),
        "labelled holds of each photo with labels that a hold meets (box IoU 0.5)": ", ".join(
            f"{found} of {total}" for found, total in met
        ),
        "whole scan, peak memory": f"{result['seconds'] / 60:.1f} min, "
        f"{result['peak_mb'] / 1024:.1f} GiB",
    }


def report_stages(name: str, result: dict[str, Any]) -> None:
    """Print seconds and memory of the stages, and their ratio to the calibration."""
    print(f"\nStages of {name}:")
    before, after = result["calibrations_s"]
    unit = (before + after) / 2
    print("\n| stage | seconds | calibrations | peak GiB |\n|---|---|---|---|")
    for stage, record in result["stages"].items():
        seconds = record["seconds"]
        cells = f"{seconds:.1f} | {seconds / unit:.0f} | {record['peak_mb'] / 1024:.1f}"
        print(f"| {stage} | {cells} |")
    whole = result["seconds"]
    print(f"| all | {whole:.1f} | {whole / unit:.0f} | {result['peak_mb'] / 1024:.1f} |")
    print(f"\ncalibration: {before:.3f} s before the scan, {after:.3f} s after it")


def boxes_found(folder: ScanFolder, labels: Path) -> tuple[int, int]:
    """Return the number of labelled boxes of one photo that projected holds match, and the total.

    Only instances that the scan shows as holds and volumes count.
    """
    view = next(v for v in read_views(folder.sparse) if Path(v.name).stem == labels.stem)
    mesh = read_mesh(folder.mesh)
    face_id, _ = render_ids(mesh.vertices, mesh.faces, view.camera, view.cam_from_world)
    shown = [hold["id"] for hold in read_json(folder.holds)["holds"]]
    face_instance = np.load(folder.instances)["face_instance"]
    face_instance = np.where(np.isin(face_instance, shown), face_instance, 0)
    seen = np.where(face_id >= 0, face_instance[np.maximum(face_id, 0)], 0)
    width, height = view.camera.width, view.camera.height
    rows = np.loadtxt(labels, ndmin=2)[:, 1:5] * [width, height, width, height]
    truth = np.column_stack([rows[:, :2] - rows[:, 2:] / 2, rows[:, :2] + rows[:, 2:] / 2])
    found = instance_boxes(seen)
    if not len(found):
        return 0, len(truth)
    return int((box_iou(truth, found).max(axis=1) >= 0.5).sum()), len(truth)


def instance_boxes(seen: NDArray[np.int32]) -> NDArray[np.float64]:
    """Return (n, 4) boxes x0, y0, x1, y1 of the ids in an id image."""
    boxes = []
    for instance in np.unique(seen[seen > 0]):
        y, x = np.nonzero(seen == instance)
        boxes.append((x.min(), y.min(), x.max() + 1, y.max() + 1))
    return np.array(boxes, dtype=np.float64).reshape(-1, 4)


def box_iou(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (n, m) intersection over union of two sets of boxes."""
    low = np.maximum(a[:, None, :2], b[None, :, :2])
    high = np.minimum(a[:, None, 2:], b[None, :, 2:])
    overlap = np.clip(high - low, 0, None).prod(axis=2)
    areas = [np.prod(boxes[:, 2:] - boxes[:, :2], axis=1) for boxes in (a, b)]
    return overlap / (areas[0][:, None] + areas[1][None] - overlap)


if __name__ == "__main__":
    sys.exit(main())
