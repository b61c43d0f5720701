"""A gym's own network: what it is trained on, and when it is worth using."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from lab.tests.train.networks import SMALL, trained_norms
from msgspec.structs import replace

from walltopo.cli import main
from walltopo.core import InputError, Silent
from walltopo.core.files import read_json
from walltopo.scans.folder import ScanFolder
from walltopo.scans.holds import Holds
from walltopo_lab.datasets.model import Annotation, Dataset, Photo
from walltopo_lab.train import own_network
from walltopo_lab.train.export import export_onnx
from walltopo_lab.train.net import build_net
from walltopo_lab.train.own_network import (
    CLASSES,
    MAX_SHARED,
    Figures,
    corrected_labels,
    is_better,
    parted,
    read_parts,
)


def photo(number: int, holds: range) -> Photo:
    rows = tuple(Annotation(1, (0, 0, 9, 9), extra={"instance": k}) for k in holds)
    return Photo(f"{number:02}.jpg", 100, 100, rows, Path(f"{number:02}.jpg"))


def test_one_end_of_the_wall_is_held_out_and_its_holds_are_not_trained_on() -> None:
    photos = tuple(photo(k, range(5 * k, 5 * k + 15)) for k in range(12))
    train, held_out = parted(Dataset(photos, CLASSES))
    assert [p.name for p in held_out] == ["09.jpg", "10.jpg", "11.jpg"]
    known = {a.extra["instance"] for p in held_out for a in p.annotations}
    assert [p.name for p in train] == [f"{k:02}.jpg" for k in range(7)]
    for p in train:
        shared = sum(a.extra["instance"] in known for a in p.annotations)
        assert shared <= MAX_SHARED * len(p.annotations)


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
    monkeypatch.setattr(own_network, "MAX_SHARED", -1.0)
    with pytest.raises(InputError, match=r"0 photos to train on and \d+ to compare on"):
        read_parts([ScanFolder(tiny_scan)], Silent())


@pytest.mark.slow
def test_the_command_trains_compares_and_says_which_to_use(
    tiny_scan: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    start = tmp_path / "start.onnx"
    export_onnx(
        trained_norms(build_net(SMALL)).eval(), start, {"version": "start", "size": SMALL.as_dict()}
    )
    monkeypatch.setattr(own_network, "shipped_model", lambda: start)
    monkeypatch.setattr(own_network, "MAX_SHARED", 1.0)  # the tiny gym is one short wall
    out = tmp_path / "ours"
    words = ["train", "gym", str(tiny_scan), "-o", str(out), "--minutes", "0.1"]
    assert main(words) == 0, capsys.readouterr().err
    assert (out / "holds.onnx").is_file()
    own = read_json(out / "own.json")
    assert own["better"] == is_better(Figures(**own["before"]), Figures(**own["after"]))
    printed = capsys.readouterr().out
    assert ("Better: use it." in printed) == own["better"]
