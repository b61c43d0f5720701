"""Volumes by masks and by shape, against the truth of generated gyms.

    python -m benchmarks.volumes SCAN GYM [SCAN GYM ...]

Each SCAN has a mesh and detections of the photos of GYM, a folder of `walltopo synth`. It is lifted
with all masks, and without the masks of volumes, as by a detector that knows none. The output for
each gym: volumes found by the masks and with the solids of the mesh (IoU of at least 0.5), false
volumes, and the mean IoU of what was found.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from walltopo.core import Mesh
from walltopo.geometry.mesh_files import read_mesh
from walltopo.scans.colmap_model import read_views
from walltopo.scans.detections import Detections
from walltopo.scans.folder import ScanFolder
from walltopo.scans.instances import InstanceRecords, InstanceTable
from walltopo.segment.propose.pieces import Ground
from walltopo.segment.propose.solids import VOLUME, add_volumes
from walltopo.segment.settings import ProposeSettings
from walltopo_lab.evaluate.align import align_views
from walltopo_lab.evaluate.carry import Carried, carry_truth
from walltopo_lab.evaluate.mesh import REACH_M
from walltopo_lab.evaluate.scan import scan_views
from walltopo_lab.evaluate.truth import CLASS_IDS, read_truth
from walltopo_lab.train.evidence import WITHIN, lift_detections

MIN_IOU = 0.5
MIN_CONFIDENCE = 0.3  # of a volume that is counted


@dataclass(frozen=True)
class Found:
    """The volumes of one scan against the truth.

    Parameters
    ----------
    overlaps : IoU of each true volume with its best match; false : volumes that match none.
    """

    overlaps: tuple[float, ...]
    false: int

    def __str__(self) -> str:
        hits = [one for one in self.overlaps if one >= MIN_IOU]
        mean = f"{np.mean(hits):.3f}" if hits else "-"
        return f"{len(hits)} of {len(self.overlaps)} | {self.false} | {mean}"


def compare(table: InstanceTable, records: InstanceRecords, carried: Carried, mesh: Mesh) -> Found:
    """Return how well the volumes among instances match the true ones (`carried`, on the mesh)."""
    label, true = table.face_instance, carried.labelled.face_instance
    area = np.where(carried.ignored, 0.0, mesh.areas)
    wanted = [k for k, kind in carried.labelled.labels.items() if kind == CLASS_IDS[VOLUME]]
    wanted = [k for k in wanted if area[true == k].sum() > 0]
    own = [
        row.id
        for row in records.instances
        if row.kind == VOLUME and row.confidence >= MIN_CONFIDENCE
    ]
    iou = np.zeros((len(wanted), len(own) + 1))
    for i, k in enumerate(wanted):
        for j, number in enumerate(own):
            either = area[(true == k) | (label == number)].sum()
            iou[i, j] = area[(true == k) & (label == number)].sum() / max(either, 1e-12)
    seen = [area[label == number].sum() > 0 for number in own]
    false = sum(s and iou[:, j].max(initial=0.0) < MIN_IOU for j, s in enumerate(seen))
    return Found(tuple(iou.max(axis=1).tolist()), false)


def measure(folder: Path, gym: Path) -> list[Found]:
    """Return what masks find, then masks and mesh; the same without the masks of volumes."""
    scan, truth = ScanFolder(folder), read_truth(gym)
    mesh = read_mesh(scan.mesh).without_guesses()
    views = read_views(scan.sparse)
    turned = align_views(scan_views(scan, truth), truth.views, False).mesh(mesh)
    carried = carry_truth(truth, turned, WITHIN, REACH_M)
    detections = Detections.load(scan.detections)
    ground = Ground.of(mesh, 1.0, True, ProposeSettings().seed)
    holds = {
        name: tuple(mask for mask in masks if detections.classes[mask.label] != VOLUME)
        for name, masks in detections.masks.items()
    }
    found = []
    for given in (detections, replace(detections, masks=holds)):
        table, records = lift_detections(mesh, views, given)
        found.append(compare(table, records, carried, mesh))
        every = np.ones(len(mesh.faces), dtype=np.bool_)
        table, records = add_volumes(ground, table, records, every, ProposeSettings().sure)
        found.append(compare(table, records, carried, mesh))
    return found


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("folders", type=Path, nargs="+", metavar="SCAN GYM")
    folders = parser.parse_args().folders
    head = "found | false | IoU"
    print(f"| gym | masks: {head} | with solids: {head} | no masks, solids: {head} |")
    print("|" + "---|" * 10)
    for scan, gym in zip(folders[::2], folders[1::2], strict=True):
        masks, both, _, solids = measure(scan, gym)
        print(f"| {gym.name} | {masks} | {both} | {solids} |", flush=True)


if __name__ == "__main__":
    main()
