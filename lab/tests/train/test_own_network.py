"""A gym's own network: what it is trained on, and when it is worth using."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
from lab.tests.train.networks import SMALL, trained_norms
from msgspec.structs import replace
from PIL import Image

from walltopo.cli import main
from walltopo.core import InputError, Mask, Silent
from walltopo.core.files import read_json
from walltopo.scans.folder import ScanFolder
from walltopo.scans.holds import Holds
from walltopo_lab.datasets.model import Annotation, Dataset, Photo
from walltopo_lab.datasets.read import write_dataset
from walltopo_lab.train import own_network
from walltopo_lab.train.cache import ignored_at, open_cache
from walltopo_lab.train.export import export_onnx
from walltopo_lab.train.net import build_net
from walltopo_lab.train.own_network import (
    CLASSES,
    Figures,
    corrected_labels,
    is_better,
    read_parts,
    split_photos,
)
from walltopo_lab.train.sets import IGNORED_CATEGORY, open_sets


def photo(number: int, holds: range) -> Photo:
    rows = tuple(Annotation(1, (0, 0, 9, 9), extra={"instance": k}) for k in holds)
    return Photo(f"{number:02}.jpg", 100, 100, rows, Path(f"{number:02}.jpg"))


def test_one_end_of_the_wall_is_held_out_and_its_holds_are_ignored() -> None:
    photos = tuple(photo(k, range(5 * k, 5 * k + 15)) for k in range(12))
    train, held_out = split_photos(Dataset(photos, CLASSES))
    assert [p.name for p in held_out] == ["09.jpg", "10.jpg", "11.jpg"]
    known = {a.extra["instance"] for p in held_out for a in p.annotations}
    assert [p.name for p in train] == [f"{k:02}.jpg" for k in range(9)]
    for p in train:
        for a in p.annotations:
            assert (a.label in CLASSES) == (a.extra["instance"] not in known)


def test_a_photo_whose_holds_are_all_held_out_is_not_trained_on() -> None:
    photos = (*(photo(k, range(10)) for k in range(3)), photo(3, range(20)), photo(4, range(20)))
    train, held_out = split_photos(Dataset(photos, CLASSES))
    assert (train, len(held_out)) == ([], 2)


def test_what_is_ignored_is_neither_hold_nor_background(tmp_path: Path) -> None:
    Image.new("RGB", (400, 400)).save(tmp_path / "wall.png")
    boxes = {1: (10, 10, 60, 60), 3: (200, 200, 80, 80)}
    rows = tuple(
        Annotation(
            label, box, mask=Mask(np.ones((box[3], box[2]), bool), *box[:2], 400, 400, label, 1.0)
        )
        for label, box in boxes.items()
    )
    wall = Photo("wall.png", 400, 400, rows, tmp_path / "wall.png")
    dataset = Dataset((wall,), {**CLASSES, 3: IGNORED_CATEGORY})
    write_dataset(tmp_path / "set", dataset, "coco-rle")
    opened = open_sets([tmp_path / "set" / "annotations.json"], tmp_path / "cache", 0.0, Silent())
    sample = open_cache(opened[0].folder, opened[0].train[0])
    assert sample.labels.tolist() == [1]
    hold, ignored = sample.ids == 1, ignored_at(np.asarray(sample.ids), 1)
    assert (hold.sum() > 0, ignored.sum() > hold.sum()) == (True, True)


@pytest.mark.parametrize(
    ("before", "after", "better"),
    [
        (Figures(0.60, 0.50), Figures(0.65, 0.50), True),
        (Figures(0.60, 0.50), Figures(0.605, 0.60), False),
        (Figures(0.60, 0.50), Figures(0.70, 0.49), False),
    ],
)
def test_a_network_is_better_by_more_than_chance_and_at_no_class_cost(
    before: Figures, after: Figures, better: bool
) -> None:
    assert is_better(before, after) == better


def test_a_removed_hold_is_background(tiny_scan: Path, tmp_path: Path) -> None:
    copy = tmp_path / "scan"
    shutil.copytree(tiny_scan, copy)
    scan = ScanFolder(copy)
    whole = corrected_labels(scan, Silent())
    assert len(whole.photos) > 4
    seen = {a.extra["instance"] for p in whole.photos for a in p.annotations}
    holds = Holds.load(scan.holds)
    gone = next(hold.id for hold in holds.holds if hold.id in seen)
    replace(holds, holds=tuple(h for h in holds.holds if h.id != gone)).save(scan.holds)
    after = corrected_labels(scan, Silent())
    assert {a.extra["instance"] for p in after.photos for a in p.annotations} == seen - {gone}


def test_too_few_photos_are_refused(tiny_scan: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(own_network, "HELD_OUT", 1.0)
    with pytest.raises(InputError, match=r"0 photos to train on and \d+ to compare on"):
        read_parts([ScanFolder(tiny_scan)], Silent())


@pytest.mark.slow
def test_the_command_trains_compares_and_says_which_to_use(
    tiny_scan: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    start = tmp_path / "start.onnx"
    export_onnx(
        trained_norms(build_net(SMALL)).eval(), start, {"version": "start", "size": SMALL.as_dict()}
    )
    monkeypatch.setattr(own_network, "shipped_model", lambda: start)
    # Two photos of the tiny gym show all of its holds: every other one is hidden here.
    hide = own_network._hide_objects
    monkeypatch.setattr(
        own_network, "_hide_objects", lambda p, known: hide(p, {k for k in known if k % 2})
    )
    out = tmp_path / "ours"
    words = ["train", "gym", str(tiny_scan), "-o", str(out), "--minutes", "0.1"]
    assert main(words) == 0, capsys.readouterr().err
    assert (out / "holds.onnx").is_file()
    own = read_json(out / "own.json")
    assert own["better"] == is_better(Figures(**own["before"]), Figures(**own["after"]))
    printed = capsys.readouterr().out
    assert ("Better: use it." in printed) == own["better"]
