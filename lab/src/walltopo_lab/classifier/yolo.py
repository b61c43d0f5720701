"""Training of the same classes with YOLO11-cls and the `ultralytics` extra (AGPL-3.0)."""

from __future__ import annotations

import json
import shutil
import tempfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Progress
from walltopo.core.files import atomic_path
from walltopo_lab.classifier.cutout_classifier import to_json
from walltopo_lab.classifier.params import ClassifierSettings
from walltopo_lab.classifier.samples import Cutouts
from walltopo_lab.classifier.split import hold_split
from walltopo_lab.extras import need_ultralytics
from walltopo_lab.onnx_file import set_metadata

BASE = "yolo11n-cls.yaml"  # random weights; `--base yolo11n-cls.pt` starts from ImageNet


def write_folders(cutouts: Cutouts, held: NDArray[np.bool_], folder: Path) -> None:
    """Write Ultralytics' layout: train/<number>/ and val/<number>/ of PNG images.

    Folders have the class's number as name, because Ultralytics sorts names and gyms name classes
    with any characters.
    """
    from PIL import Image

    for part in ("train", "val"):
        for number in range(len(cutouts.names)):
            (folder / part / f"{number:04d}").mkdir(parents=True)
    for row, (label, kept) in enumerate(zip(cutouts.label, held, strict=True)):
        part = "val" if kept else "train"
        Image.fromarray(cutouts.pictures[row]).save(folder / part / f"{label:04d}" / f"{row}.png")


def train_yolo(
    cutouts: Cutouts,
    settings: ClassifierSettings,
    path: Path,
    base: str,
    progress: Progress,
) -> float:
    """Train and export; return the share of held-out cutouts that are classified correctly.

    Raises
    ------
    EnvironmentLacksError : the extra is not installed.
    """
    library = need_ultralytics(
        "--family yolo", "leave out --family: walltopo's own network needs only the extra train"
    )
    progress.step("training YOLO11-cls")
    held = hold_split(cutouts, settings.held_out, settings.seed)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_folders(cutouts, held, folder / "data")
        model = library.YOLO(base)
        model.train(
            data=str(folder / "data"),
            imgsz=settings.side,
            epochs=settings.epochs,
            batch=settings.batch,
            seed=settings.seed,
            hsv_h=settings.hue,
            degrees=settings.rotation,
            project=str(folder),
            name="run",
            workers=0,
            verbose=False,
            plots=False,
        )
        figures = model.val(verbose=False, plots=False)
        written = Path(str(model.export(format="onnx", imgsz=settings.side, dynamic=True)))
        _label(written, cutouts, settings.side)
        with atomic_path(path) as temporary:
            shutil.copyfile(written, temporary)
    return float(figures.top1)


def _label(path: Path, cutouts: Cutouts, side: int) -> None:
    """Replace the folders' numbers by the classes' own names and meanings."""
    facts = {
        "names": json.dumps(list(cutouts.names)),
        "classes": to_json(cutouts.meanings),
        "side": str(side),
    }
    set_metadata(path, facts)
