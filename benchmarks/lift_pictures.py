"""Draw the pictures of docs/lift.md, each of one step of the lift.

python -m benchmarks.lift_pictures docs/pictures/lift
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from benchmarks.lift_scenes import MaskNoise, make_scene, spoil
from walltopo.core import Mesh, Silent, View
from walltopo.geometry.zbuffer import render_ids
from walltopo.segment.lift import LiftParams, lift
from walltopo.segment.lift.blocks import blocks_of
from walltopo.segment.lift.evidence import Sampling, gather_evidence
from walltopo.segment.lift.similarity import compare_projections
from walltopo.segment.lift.vote import tidy_order
from walltopo.segment.lift_files import instance_colours

Colours = NDArray[np.uint8]
GREY = (150, 150, 150)


def shaded(mesh: Mesh, view: View, colours: Colours) -> Colours:
    """Return a rendering of the mesh, each face in its colour (sRGB), lit from the camera."""
    ids, _ = render_ids(mesh.vertices, mesh.faces, view.camera, view.cam_from_world)
    light = np.abs(mesh.normals @ (view.direction + [0.35, 0.0, -0.45]))
    image = np.full((*ids.shape, 3), 255, dtype=np.uint8)
    lit = colours * np.clip(0.35 + 0.7 * light[:, None], 0, 1)
    image[ids >= 0] = lit.astype(np.uint8)[ids[ids >= 0]]
    return image


def heat(values: NDArray[Any]) -> Colours:
    """Return colours from blue (0) over white (0.5) to red (1)."""
    t = np.clip(values, 0, 1)[:, None]
    low, middle, high = np.array([40, 80, 200]), np.array([245, 245, 245]), np.array([200, 40, 30])
    mixed = np.where(t < 0.5, low + (middle - low) * 2 * t, middle + (high - middle) * (2 * t - 1))
    return mixed.astype(np.uint8)


def save(folder: Path, name: str, image: Colours) -> None:
    small = cv2.resize(
        image, (800, round(800 * image.shape[0] / image.shape[1])), interpolation=cv2.INTER_AREA
    )
    cv2.imwrite(str(folder / name), small[..., ::-1], [cv2.IMWRITE_PNG_COMPRESSION, 9])


def main(folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    scene = make_scene(7, width=3.2, height=2.4, objects=26, views=22)
    views = spoil(scene.views, MaskNoise(), 3)
    # Show the photo with the largest total mask area.
    shown = max(range(len(views)), key=lambda k: sum(mask.area for mask in scene.views[k].masks))
    mesh, view = scene.mesh, views[shown]
    colours = instance_colours(64)

    masks = shaded(mesh, view, np.full((len(mesh.faces), 3), GREY, dtype=np.uint8))
    for number, mask in enumerate(view.masks, start=1):
        inside = mask.full()
        masks[inside] = (0.35 * masks[inside] + 0.65 * colours[number]).astype(np.uint8)
    save(folder, "1-masks.png", masks)

    sampling = Sampling(8.0, band=4.0, max_splits=8)
    evidence = gather_evidence(
        blocks_of(mesh), views, lambda v: tidy_order(v, "small", True), sampling, Silent()
    )
    entry_face = np.repeat(np.arange(len(evidence.faces)), np.diff(evidence.starts))
    painted = np.full((len(mesh.faces), 3), GREY, dtype=np.uint8)
    mine = evidence.view == shown
    painted[evidence.faces[entry_face[mine]]] = (60, 60, 70)  # seen, on no mask
    on = mine & (evidence.projection >= 0)
    number = evidence.projection[on] - evidence.first_mask[shown] + 1
    painted[evidence.faces[entry_face[on]]] = colours[number]
    save(folder, "2-projections.png", shaded(mesh, view, painted))

    pairs = compare_projections(evidence)
    found = lift(mesh, views, LiftParams())
    cluster = np.zeros(len(evidence.label), dtype=np.int64)
    for record in found.records:
        for v, m in record.views:
            cluster[evidence.first_mask[v] + m] = record.id
    order = np.argsort(np.where(cluster == 0, 1 << 20, cluster), kind="stable")
    rank = np.argsort(order)
    matrix = np.zeros((len(cluster), len(cluster)))
    matrix[rank[pairs.p], rank[pairs.q]] = pairs.iou
    picture = 255 - (matrix[..., None] * [225, 120, 40]).astype(np.uint8)
    large = cv2.resize(picture, (800, 800), interpolation=cv2.INTER_NEAREST)
    save(folder, "3-overlaps.png", large.astype(np.uint8))

    share = np.zeros(len(mesh.faces))
    seen = np.bincount(entry_face, minlength=len(evidence.faces))
    hits = np.bincount(entry_face[evidence.projection >= 0], minlength=len(evidence.faces))
    share[evidence.faces] = hits / np.maximum(seen, 1)
    save(folder, "4-evidence.png", shaded(mesh, view, heat(share)))

    literal = lift(mesh, views, LiftParams(method="literal"))
    for name, result in (("5-literal.png", literal), ("6-robust.png", found)):
        save(folder, name, shaded(mesh, view, colours[result.face_instance]))
    save(folder, "7-truth.png", shaded(mesh, view, colours[scene.face_instance]))
    print(f"literal {len(literal)}, robust {len(found)}, truth {len(scene.labels)} instances")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
