"""The part of a generated hall that a scan's page shows, against the truth.

    python -m benchmarks.surroundings FOLDER --seeds 1 2 3

Ten kinds of halls: each seed has another preset, side walls that adjoin the climbing wall, stand
near it or far from it, and up to three benches. In FOLDER each hall is made and scanned, if it is
not there yet. Triangles of the scan are sorted by the nearest point of the truth. Of the room, what
lies within a hand's breadth (and the width of a mesh edge) of the wall does not count. The output
for each hall: the share of the room that the page leaves out, the share of the wall that it shows,
and the holds and volumes of which it shows less than nine tenths of what was scanned.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from benchmarks.dense import sample
from walltopo.cli import main as walltopo
from walltopo.geometry.mesh_files import read_mesh
from walltopo.publish.coarse_wall import coarse_wall
from walltopo.publish.shown import shown_faces
from walltopo.publish.surroundings import HAND
from walltopo.publish.wall_data import read_wall
from walltopo.scans.folder import ScanFolder
from walltopo_lab.evaluate.align import align_views
from walltopo_lab.evaluate.scan import scan_views
from walltopo_lab.evaluate.truth import read_truth

PHOTOS, SIZE = 18, "1024x768"
PRESETS = ("modern", "easy", "oldschool-dark", "sprawall")
ROOMS = (0.0, 0.6, 2.5)
_SAMPLES = 3_000_000
_EDGE = 0.02
_SHOWN = 0.9  # share of a hold's triangles


@dataclass(frozen=True)
class Hall:
    """The part of one hall that is shown.

    Parameters
    ----------
    room, wall : scanned area in m² beyond a hand's breadth of the wall, and of the wall.
    gone, kept : share of the room that is left out, and of the wall that is shown.
    holds, lost : holds and volumes scanned, and those that are not shown.
    """

    room: float
    wall: float
    gone: float
    kept: float
    holds: int
    lost: int

    def __str__(self) -> str:
        shares = f"{self.room:.1f} m² | {self.gone:.1%} | {self.wall:.1f} m² | {self.kept:.1%}"
        return f"{shares} | {self.lost} of {self.holds}"


def make_hall(folder: Path, seed: int) -> tuple[Path, Path]:
    """Return the folders of a hall and of its scan, made where they are missing."""
    gym, scan = folder / f"hall-{seed}", folder / f"scan-{seed}"
    kind, room = PRESETS[seed % len(PRESETS)], ROOMS[seed % len(ROOMS)]
    words = ["synth", str(gym), "--preset", kind, "--seed", str(seed), "--photos", str(PHOTOS)]
    words += ["--size", SIZE, "--wall-width", "5", "--set", f"room={room}"]
    words += ["--set", f"benches={seed % 4}"]
    if not (gym / "truth/gt.npz").is_file() and walltopo(words) != 0:
        raise SystemExit(f"{gym} was not made")
    if walltopo(["scan", str(gym / "photos"), "-o", str(scan), "--to", "edit"]) != 0:
        raise SystemExit(f"{gym} was not scanned")
    return gym, scan


def measure(gym: Path, folder: Path) -> Hall:
    """Return the part of a hall that is shown."""
    scan, truth = ScanFolder(folder), read_truth(gym)
    wall = read_wall(scan)
    cut = ~shown_faces(wall, coarse_wall(wall.mesh, wall.face_instance))
    with np.load(gym / "truth/gt.npz") as arrays:
        of_wall = arrays["face_wall"]
    points, face = sample(truth.mesh, np.ones(len(truth.mesh.faces)), _SAMPLES, seed=1)
    turned = align_views(scan_views(scan, truth), truth.views, False).mesh(read_mesh(scan.mesh))
    _, nearest = cKDTree(points).query(turned.centroids, workers=-1)
    on_wall = of_wall[face[nearest]]
    away, _ = cKDTree(points[of_wall[face]]).query(turned.centroids, workers=-1)
    room = ~on_wall & (away > HAND + _EDGE)
    number = truth.face_instance[face[nearest]]
    area = turned.areas
    whole = np.bincount(number, area)[1:]
    shown = np.bincount(number, area * ~cut, minlength=len(whole) + 1)[1:]
    holds = whole > 0
    lost = holds & (shown < _SHOWN * whole)
    return Hall(
        room=float(area[room].sum()),
        wall=float(area[on_wall].sum()),
        gone=float(area[room & cut].sum() / max(area[room].sum(), 1e-9)),
        kept=float(area[on_wall & ~cut].sum() / area[on_wall].sum()),
        holds=int(holds.sum()),
        lost=int(lost.sum()),
    )


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("folder", type=Path, help="where halls and scans are made")
    parser.add_argument("--seeds", type=int, nargs="+", default=list(range(20, 30)))
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    print("| hall | room | left out | wall | shown | holds and volumes not shown |")
    print("|---|---|---|---|---|---|")
    for seed in options.seeds:
        found = measure(*make_hall(options.folder, seed))
        print(f"| {seed}: {PRESETS[seed % len(PRESETS)]} | {found} |", flush=True)


if __name__ == "__main__":
    main()
