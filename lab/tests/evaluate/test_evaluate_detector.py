"""COCO figures of detections: by hand, and the command."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np
import pytest

from walltopo.core import InputError
from walltopo_lab.cli import evaluate as commands
from walltopo_lab.datasets.coco import write_coco
from walltopo_lab.datasets.model import Annotation, Dataset, Photo
from walltopo_lab.datasets.shapes import ellipse, rectangle
from walltopo_lab.evaluate.detector import evaluate_detections

CLASSES = {1: "hold", 2: "volume"}


def row(label: int, x: float, y: float, w: float, h: float, score: float = 1.0) -> Annotation:
    return Annotation(label, (x, y, w, h), (rectangle(x, y, w, h),), score=score)


def one_photo(*rows: Annotation) -> Dataset:
    return Dataset((Photo("a.jpg", 200, 200, rows),), CLASSES)


def test_hits_misses_and_a_wrong_class() -> None:
    truth = one_photo(row(1, 10, 10, 50, 50), row(2, 100, 100, 60, 60))
    found = one_photo(row(1, 10, 10, 50, 50, 0.9), row(1, 100, 100, 60, 60, 0.8))
    metrics = evaluate_detections(found, truth)
    for run in (metrics.boxes, metrics.masks):
        assert run["all"].ap == pytest.approx(1.0)
        assert run["hold"].ap50 == pytest.approx(1.0)  # the false one comes after full recall
        assert run["volume"].ap50 == 0.0
        assert run["mean"].ap50 == pytest.approx(0.5)
        assert run["all"].recall50["over 40 px"] == 1.0


def test_photo_without_detections_counts_as_missed() -> None:
    truth = Dataset(
        tuple(Photo(f"{k}.jpg", 99, 99, (row(1, 5, 5, 50, 50),)) for k in range(2)), CLASSES
    )
    found = truth.subset({"1.jpg"})
    assert evaluate_detections(found, truth).boxes["hold"].recall50["all"] == 0.5


def test_box_only_truth_compares_boxes_only() -> None:
    truth = one_photo(Annotation(1, (10, 10, 50, 50)))
    metrics = evaluate_detections(one_photo(row(1, 10, 10, 50, 50)), truth)
    assert metrics.masks == {}
    assert np.isnan(metrics.boxes["volume"].ap)
    assert metrics.as_dict()["boxes"]["volume"]["ap"] is None


def test_other_photos_and_other_sizes_are_refused() -> None:
    truth = one_photo(row(1, 10, 10, 50, 50))
    with pytest.raises(InputError, match="none"):
        evaluate_detections(Dataset((Photo("b.jpg", 200, 200),), CLASSES), truth)
    with pytest.raises(InputError, match="200x200"):
        evaluate_detections(Dataset((Photo("a.png", 100, 100),), CLASSES), truth)


def random_sets(seed: int) -> tuple[Dataset, Dataset]:
    """150 objects in one photo (more than COCO's cap), found with errors and false ones."""
    rng = np.random.default_rng(seed)
    true, found = [], []
    for _ in range(150):
        cx, cy, rx, ry = *rng.uniform(20, 380, 2), *rng.uniform(3, 18, 2)
        label = int(rng.integers(1, 3))
        outline = ellipse(cx, cy, rx, ry)
        true.append(Annotation(label, (cx - rx, cy - ry, 2 * rx, 2 * ry), (outline,)))
        if rng.random() < 0.85:
            x, y = rng.normal(0, 3, 2)
            moved = outline + np.array([x, y])
            box = (cx - rx + x, cy - ry + y, 2 * rx, 2 * ry)
            found.append(Annotation(label, box, (moved,), score=float(rng.random())))
    for _ in range(20):
        cx, cy = rng.uniform(20, 380, 2)
        box = (cx - 9.0, cy - 9.0, 18.0, 18.0)
        found.append(Annotation(1, box, (ellipse(cx, cy, 9, 9),), score=float(rng.random())))
    return (
        Dataset((Photo("a.jpg", 400, 400, tuple(found)),), CLASSES),
        Dataset((Photo("a.jpg", 400, 400, tuple(true)),), CLASSES),
    )


def test_the_cap_of_100_hides_some() -> None:
    run = evaluate_detections(*random_sets(0)).boxes["all"]
    assert run.objects == 150
    assert run.ap100 < run.ap


def test_command_writes_figures_and_curves(tmp_path: Path) -> None:
    found, truth = random_sets(5)
    write_coco(tmp_path / "truth.json", truth)
    write_coco(tmp_path / "found.json", found, scores=True)
    parser = argparse.ArgumentParser()
    commands.register(parser.add_subparsers())
    files = [str(tmp_path / name) for name in ("found.json", "truth.json", "out")]
    args = parser.parse_args(
        ["evaluate", "detector", files[0], "--truth", files[1], "-o", files[2]]
    )
    assert args.run(args) == 0
    figures = json.loads((tmp_path / "out/figures.json").read_text())
    assert figures["boxes"]["all"]["objects"] == 150
    assert (tmp_path / "out/curves-masks.png").is_file()
