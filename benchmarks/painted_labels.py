"""Labels from a painted, reconstruction-like mesh, and from true boxes, against true masks.

python -m benchmarks.painted_labels DATA
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from pathlib import Path

from walltopo.core import Camera, View
from walltopo_lab.datasets.compare import compare_sets
from walltopo_lab.datasets.model import Annotation, Dataset
from walltopo_lab.datasets.project import project_labels
from walltopo_lab.datasets.refine import grabcut, refine_dataset
from walltopo_lab.evaluate.truth import Truth, read_truth

CLASSES = {1: "hold", 2: "volume"}
CAMERA = Camera("SIMPLE_RADIAL", 1280, 960, (947.2, 640.0, 480.0, 0.035))


def boxes_as_masks(dataset: Dataset) -> Dataset:
    """Return the dataset with each mask replaced by its box."""
    photos = (
        photo.with_annotations(tuple(Annotation(a.label, a.box) for a in photo.annotations))
        for photo in dataset.photos
    )
    return Dataset(tuple(photos), CLASSES)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("data", type=Path)
    gym = parser.parse_args().data / "gym-a"
    exact, painted = read_truth(gym), read_truth(gym / "lift")
    views = [
        View(name, CAMERA, exact.views[name].cam_from_world) for name in sorted(exact.views)[:60:4]
    ]

    def labels_of(truth: Truth) -> Dataset:
        labels = truth.labelled.labels
        return project_labels(
            truth.mesh, truth.face_instance, labels, CLASSES, views, gym / "photos"
        )

    true = labels_of(exact)
    begin = time.process_time()
    projected = labels_of(painted)
    projecting = time.process_time() - begin
    boxes = boxes_as_masks(true)
    ways: dict[str, Callable[[], Dataset]] = {
        "painted mesh": lambda: projected,
        "painted mesh, GrabCut": lambda: refine_dataset(projected, grabcut)[0],
        "true boxes as masks": lambda: boxes,
        "true boxes, GrabCut": lambda: refine_dataset(boxes, grabcut)[0],
    }
    print("| labels | mIoU | without wall | IoU of objects | CPU-s |")
    print("|---|---|---|---|---|")
    for name, make in ways.items():
        begin = time.process_time()
        dataset = make()
        seconds = time.process_time() - begin + (projecting if name.startswith("painted") else 0.0)
        found = compare_sets(dataset, true).as_dict()
        cells = " | ".join(f"{found[key]:.3f}" for key in ("miou", "miou_objects", "instance_iou"))
        print(f"| {name} | {cells} | {seconds:.1f} |")


if __name__ == "__main__":
    main()
