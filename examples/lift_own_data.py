"""2D masks of anything to 3D instances, in a program of yours.

python examples/lift_own_data.py MESH CAMERAS MASKS

MESH: PLY, OBJ or GLB; CAMERAS: a COLMAP model or transforms.json; MASKS: COCO, or PNGs of numbers.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import walltopo
from walltopo.segment.lift_files import read_cameras, read_masks
from walltopo.segment.lift_matching import attach_masks


def main(mesh_file: Path, cameras: Path, mask_files: Path) -> None:
    mesh = walltopo.read_mesh(mesh_file)
    masks = read_masks(mask_files)
    matched = attach_masks(read_cameras(cameras, masks.sizes), masks.masks)
    print(matched.describe_loss() or "each photo of the masks has a camera")
    # Lengths relative to the distance of the cameras, for a scene without a scale.
    found = walltopo.lift(mesh, matched.views, walltopo.LiftParams(normalised=True))
    for instance in found.records:
        triangles = np.flatnonzero(found.face_instance == instance.id)
        print(f"{instance.id}: {len(triangles)} triangles, score {instance.score:.2f}")


if __name__ == "__main__":
    if len(sys.argv) != 4:
        sys.exit("usage: python examples/lift_own_data.py MESH CAMERAS MASKS")
    main(*(Path(word) for word in sys.argv[1:]))
